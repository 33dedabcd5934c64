//! Tail probabilities and probabilities of intervals, with derivatives.

use ppl::prelude::*;

use crate::densities::assert_same;

ppl::model! {
    fn by_hand(below: &[f64], above: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for x in below {
            factor(Normal(mean, sd).ln_cdf(*x));
        }
        for x in above {
            factor(Normal(mean, sd).ln_sf(*x));
        }
        #[track] let beyond = Normal(mean, sd).sf(2.0);
    }

    fn censored(below: &[f64], above: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for x in below {
            x ~ Normal(mean, sd).censor(*x..);
        }
        for high in above {
            high ~ Normal(mean, sd).censor(..*high);
        }
    }
}

ppl::model! {
    /// Data in classes with unknown limits, a truncation at an unknown end, and a copula.
    fn unknown_ends(classes: &[usize], lifetimes: &[f64], pairs: &[[f64; 2]]) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ LogNormal(0.0, 0.5);
        let low ~ Normal(-0.5, 0.2);
        let width ~ HalfNormal(1.0);
        let high = low + width;
        let end ~ Uniform(2.0, 5.0);
        let rate ~ LogNormal(0.0, 0.5);
        let tied ~ Uniform(-0.9, 0.9);
        let d = Normal(mean, sd);
        for class in classes {
            factor(match class {
                0 => d.ln_cdf(low),
                1 => d.ln_mass_between(low, high),
                _ => d.ln_sf(high),
            });
        }
        for t in lifetimes {
            factor(Exponential(rate).ln_density(&Real::from(t)) - Exponential(rate).ln_cdf(end));
        }
        for pair in pairs {
            // computed from the smaller tail, which keeps more digits
            let z = pair.map(|x| {
                let (below, above) = (d.ln_cdf(x), d.ln_sf(x));
                if below < above {
                    below.exp().normal_quantile()
                } else {
                    -above.exp().normal_quantile()
                }
            });
            factor(-0.5 * (1.0 - tied.square()).ln() + z[0] * z[1] * tied);
        }
    }

    fn unknown_ends_in_closed_form(classes: &[usize], lifetimes: &[f64], pairs: &[[f64; 2]]) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ LogNormal(0.0, 0.5);
        let low ~ Normal(-0.5, 0.2);
        let width ~ HalfNormal(1.0);
        let end ~ Uniform(2.0, 5.0);
        let rate ~ LogNormal(0.0, 0.5);
        let tied ~ Uniform(-0.9, 0.9);
        let below = ((low - mean) / sd).normal_cdf();
        let above = ((mean - low - width) / sd).normal_cdf();
        for class in classes {
            factor([below, 1.0 - below - above, above][*class].ln());
        }
        for t in lifetimes {
            factor(rate.ln() - rate * *t - (rate * end).ln_one_minus_exp());
        }
        for pair in pairs {
            let z = pair.map(|x| (x - mean) / sd);
            factor(-0.5 * (1.0 - tied.square()).ln() + z[0] * z[1] * tied);
        }
    }
}

#[test]
fn ends_may_be_unknown() {
    let data = (&[0, 1, 1, 2, 0][..], &[0.3, 1.7][..], &[[0.2, -0.3], [1.0, 0.8]][..]);
    let one = unknown_ends(data.0, data.1, data.2);
    assert_same(&one, &unknown_ends_in_closed_form(data.0, data.1, data.2));
    ppl::check::gradient(&one, 7);
}

/// A limit outside the support or at infinity has derivative 0.
#[test]
fn ends_outside_the_support() {
    let [x, rate] = ppl::Dual::variables([-1.0, 2.0]);
    let beyond = Exponential(rate).ln_sf(x);
    assert_eq!((beyond.value(), beyond.gradient()), (0.0, [0.0, 0.0]));
    let before: f64 = Exponential(2.0).ln_cdf(-1.0);
    assert_eq!(before, f64::NEG_INFINITY);
    let backwards: f64 = Normal(0.0, 1.0).ln_mass_between(1.0, -1.0);
    assert_eq!(backwards, f64::NEG_INFINITY);
}

#[test]
fn tails_are_those_of_censored_data() {
    let (below, above) = ([-0.7, 0.4], [1.1]);
    let (one, other) = (by_hand(&below, &above), censored(&below, &above));
    assert_same(&one, &other);
    ppl::check::gradient(&one, 7);
}
