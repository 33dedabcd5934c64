//! The language of `model!` against the same models by hand.

use ppl::prelude::*;

ppl::model! {
    /// A line.
    pub fn line(x: &[f64], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ Normal(0.15, 0.25).truncate(0.0..);
        #[track] let twice = 2.0 * slope[1] + 1.0 - 0.5 * slope[0] / sd;
        for (x, y) in x.iter().zip(y) {
            let mean = slope[0] * x + slope[1] - 0.1 * (1.0 - sd);
            y ~ Normal(mean, sd);
        }
        #[predict] let new ~ Normal(slope[1], sd);
        #[predict] let sum = new + twice;
    }
}

#[test]
fn first() {
    let (x, y) = ([0.0, 1.0, 2.0], [0.1, 0.9, 2.2]);
    let model = line(&x, &y);
    let layout = model.layout().unwrap();
    assert_eq!(layout.dim, 3);
    let names: Vec<_> = layout
        .variables
        .iter()
        .map(|v| (v.name.as_str(), v.shape.clone()))
        .collect();
    assert_eq!(
        names,
        [
            ("slope", vec![2]),
            ("sd", vec![]),
            ("twice", vec![]),
            ("y", vec![3]),
            ("new", vec![]),
            ("sum", vec![])
        ]
    );
}
