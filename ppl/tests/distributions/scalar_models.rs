//! Mixtures, truncation and censoring inside models. Samplers omit constants and propagate partial derivatives of terms
//! immediately; neither may change values that are used in further computations.

use ppl::Workspace;
use ppl::prelude::*;

use crate::numerics::constrained;

ppl::model! {
    fn wrapped(ys: &[f64], ks: &[u64]) {
        let m ~ Normal(0.0, 1.0);
        let w ~ Beta(2.0, 2.0);
        let rate ~ Gamma(2.0, 1.0);
        let t ~ StudentT(4.0, m, 1.0).truncate(0.0..);
        let mode ~ Normal(m + t, 2.0);
        let rest = 1.0 - w;
        for y in ys {
            y ~ Mixture([w, rest], [Normal(m, 0.5), Normal(mode, 2.0)]);
        }
        for limited in ys {
            limited ~ Gamma(rate, 2.0).censor(0.5..2.0);
        }
        for mixed in ks {
            mixed ~ Mixture([w, rest], [Poisson(rate), Poisson(t)]);
        }
    }
}

#[test]
fn gradients_and_values_in_a_model() {
    let (ys, ks) = ([0.4, 1.3, 3.5], [0u64, 2, 5]);
    let model = wrapped(&ys, &ks);
    ppl::check::gradient(&model, 7);

    let mut workspace = Workspace::default();
    let y = [0.4, -0.3, 0.2, 0.1, 0.8];
    let mut gradient = [0.0; 5];
    let value = model.gradient(&y, &mut gradient, &mut workspace).unwrap();
    // the same density computed by hand with plain numbers
    let mut total = 0.0;
    let mut at = y.iter().copied();
    let mut add = |(x, term): (f64, f64)| {
        total += term;
        x
    };
    let mut next = || at.next().unwrap();
    let m: f64 = add(constrained(&Normal(0.0, 1.0), &mut next, true));
    let w = add(constrained(&Beta(2.0, 2.0), &mut next, true));
    let rate = add(constrained(&Gamma(2.0, 1.0), &mut next, true));
    let t = add(constrained(&StudentT(4.0, m, 1.0).truncate(0.0..), &mut next, true));
    let mode = add(constrained(&Normal(m + t, 2.0), &mut next, true));
    let weights = [w, 1.0 - w];
    for y in &ys {
        total += Mixture(weights, [Normal(m, 0.5), Normal(mode, 2.0)]).ln_density(y);
        total += Gamma(rate, 2.0).censor(0.5..2.0).ln_density(y);
    }
    for k in &ks {
        let both = Mixture(weights, [Poisson(rate), Poisson(t)]);
        total += Distribution::<f64>::ln_density(&both, k);
    }
    assert!((value - total).abs() < 1e-10 * total.abs(), "{value} against {total}");
}
