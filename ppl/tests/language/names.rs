//! Names that mean both a type and a constant.

use ppl::prelude::*;

/// A type with the name of a const parameter; the type has no values.
#[expect(dead_code)]
struct V;

ppl::model! {
    fn constant<const V: usize>(ys: &[[f64; V]]) {
        let a ~ Normal(0.0, 1.0).array::<{ V }>();
        let shift ~ part([0.0; 2], a[0]);
        for y in ys {
            for k in 0..V {
                y[k] ~ Normal(a[k] + shift, 1.0);
            }
        }
    }

    fn part<const V: usize>(centres: [f64; V], scale: Real) -> Real {
        let z ~ Normal(centres[V - 1], 1.0);
        z * scale
    }
}

#[test]
fn constants_may_have_the_names_of_types() {
    let ys = [[1.0, 2.0, 3.0]];
    let model = constant(&ys);
    assert_eq!(model.layout().unwrap().dim, 4);
}
