//! Probabilities beyond a limit, as numbers with derivatives.

use ppl::prelude::*;

use crate::densities::assert_same;

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
    assert_same(&one, &other);
    ppl::check::gradient(&one, 7);
}
