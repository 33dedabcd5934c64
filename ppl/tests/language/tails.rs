//! Probabilities beyond a limit, as numbers with derivatives.

use ppl::Workspace;
use ppl::prelude::*;

ppl::model! {
    fn by_hand(below: &[f64], above: &[f64], few: u64) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        let rate ~ Gamma(2.0, 1.0);
        for x in below {
            factor(Normal(mean, sd).ln_cdf(*x));
        }
        for x in above {
            factor(Normal(mean, sd).ln_sf(*x));
        }
        factor(Poisson(rate).ln_cdf(few) + Poisson(rate).ln_sf(few));
        #[track] let beyond = Normal(mean, sd).sf(2.0);
    }

    fn censored(below: &[f64], above: &[f64], few: u64) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        let rate ~ Gamma(2.0, 1.0);
        for x in below {
            x ~ Normal(mean, sd).censor(*x..);
        }
        for high in above {
            high ~ Normal(mean, sd).censor(..*high);
        }
        let limit = few as f64;
        few ~ Poisson(rate).censor(limit..);
        let more = few + 1;
        more ~ Poisson(rate).censor(..limit + 1.0);
    }
}

#[test]
fn tails_are_those_of_censored_data() {
    let (below, above) = ([-0.7, 0.4], [1.1]);
    let (one, other) = (by_hand(&below, &above, 3), censored(&below, &above, 3));
    let (mut workspace, point) = (Workspace::default(), [0.3, -0.4, 0.8]);
    let [mut a, mut b] = [[0.0; 3]; 2];
    let values = (
        one.gradient(&point, &mut a, &mut workspace).expect("finite"),
        other.gradient(&point, &mut b, &mut workspace).expect("finite"),
    );
    approx::assert_relative_eq!(values.0, values.1, max_relative = 1e-12);
    for (a, b) in a.iter().zip(b) {
        approx::assert_relative_eq!(*a, b, max_relative = 1e-12);
    }
    ppl::check::gradient(&one, 7);
}
