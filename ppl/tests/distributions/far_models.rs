//! Models with truncation and censoring at probabilities below the smallest number, and with heavy tails.

use approx::assert_relative_eq;
use ppl::prelude::*;
use ppl::{Univariate, UnivariateDensity};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    /// Fractions measured with an instrument whose range ends at 0.95.
    fn shares(data: &[f64]) {
        let a ~ LogNormal(0.0, 1.5);
        let b ~ LogNormal(0.0, 1.5);
        for x in data {
            x ~ Beta(a, b).censor(..0.95);
        }
    }

    /// Lifetimes of which most exceed the duration of the test.
    fn lives(data: &[f64]) {
        let shape ~ LogNormal(0.0, 1.0);
        let rate ~ LogNormal(0.0, 1.0);
        for x in data {
            x ~ Gamma(shape, rate).censor(..900.0);
        }
    }

    /// Currents whose unknowns and data have the size of `unit`.
    fn currents(data: &[f64], unit: f64) {
        let level ~ Normal(5.0 * unit, 2.0 * unit);
        let spread ~ HalfNormal(unit);
        for x in data {
            x ~ Normal(level, spread);
        }
    }

    fn heavy(data: &[f64]) {
        let nu ~ LogNormal(0.0, 1.0);
        let scale ~ LogNormal(0.0, 1.0);
        for x in data {
            x ~ StudentT(nu, 0.0, scale).censor(-50.0..20.0);
        }
    }
}

/// Compares the gradients of censored data with finite differences, and checks that the mode is found.
#[test]
fn gradients_of_censored_data_are_exact() {
    let few = shares(&[0.2, 0.7, 0.95, 0.4, 0.95]);
    ppl::check::gradient(&few, 7);
    assert!(Map::default().find(&few).expect("a mode").converged);
    let long = lives(&[3.0, 900.0, 40.0, 900.0]);
    ppl::check::gradient(&long, 7);
    assert!(Map::default().find(&long).expect("a mode").converged);
    ppl::check::gradient(&heavy(&[0.3, -60.0, 25.0, 1.2]), 7);
}

/// A model of data with values of about 1e-12 (currents in amperes instead of picoamperes) starts. Its mean level and
/// its mode are 1e-12 times the mean level and the mode of data with values of about 1.
#[test]
fn data_in_units_of_1e_12_have_the_mode_of_data_in_units_of_1() {
    let values = [5.1, 4.2, 6.3, 5.6, 4.9, 5.4];
    let in_amperes = values.map(|value| 1e-12 * value);
    let [large, small] = [currents(&values, 1.0), currents(&in_amperes, 1e-12)];
    let nuts = Nuts::default().seed(5);
    let [large_run, small_run] =
        [&large, &small].map(|model| nuts.sample(model).expect("the model starts"));
    // the first steps of the sampler are as small as the level, so that the logarithm of the spread, of size 1, mixes
    // slowly: only the level is compared
    let [(expected, error), (got, small_error)] = [&large_run, &small_run].map(|run| {
        let values = &run.values("level").expect("an unknown").data;
        let chains: Vec<&[f64]> = values.chunks_exact(run.posterior.draws).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (mean, ppl::diagnostics::mcse_mean(&chains))
    });
    let allowed = 4.0 * error.hypot(1e12 * small_error);
    assert!(allowed < 0.4, "{allowed}");
    assert!((1e12 * got - expected).abs() < allowed, "{got}, {expected} ± {allowed}");
    let [large, small] = [&large, &small].map(|model| Map::default().find(model).expect("a mode"));
    assert!(small.converged, "{small:?}");
    assert_relative_eq!(1e12 * small.point[0], large.point[0], max_relative = 1e-3);
}

/// Truncations beyond 38 standard deviations: the probability of the interval underflows, but draws and `validate` must
/// work. The moments are compared with the asymptotic series of the Mills ratio, to all digits.
#[test]
fn truncations_beyond_the_smallest_number() {
    let far = Normal(1.0, 2.0).truncate(121.0..);
    assert!(Univariate::validate(&far).is_ok());
    let (a, mills) = (60.0f64, ppl::special::mills_ratio(60.0));
    assert_relative_eq!(far.mean(), 1.0 + 2.0 / mills, max_relative = 1e-12);
    let variance = 4.0 * (1.0 + a / mills - mills.powi(-2));
    assert_relative_eq!(far.variance(), variance, max_relative = 1e-7);
    let density: f64 = far.ln_density(&121.0);
    assert_relative_eq!(density, -(2.0 * mills).ln(), max_relative = 1e-13);
    assert_relative_eq!(far.cdf(far.quantile(0.3)), 0.3, max_relative = 1e-10);
    // beyond the end, the distribution is exponential up to 1/60²
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let draws: Vec<f64> = (0..4000).map(|_| far.sample(&mut rng)).collect();
    let mean = draws.iter().sum::<f64>() / 4000.0;
    assert!((mean - far.mean()).abs() < 4.0 * (far.variance() / 4000.0).sqrt(), "{mean}");

    // a power law: the median is 2^(1/ν) times the end, the mean is ν/(ν − 1) times the end
    let far = StudentT(30.0, 0.0, 1.0).truncate(1e12..);
    assert_relative_eq!(far.quantile(0.5), 1e12 * 2f64.powf(1.0 / 30.0), max_relative = 1e-12);
    assert_relative_eq!(far.mean(), 1e12 * 30.0 / 29.0, max_relative = 1e-10);
    // the left tail is the mirror image of the right tail
    let left = StudentT(30.0, 0.0, 1.0).truncate(..-1e12);
    assert_relative_eq!(left.quantile(0.25), -far.upper_quantile(0.25), max_relative = 1e-13);
    // near 0, the density is a power of x, which determines the quantiles
    let near = Gamma(500.0, 1.0).truncate(..1e-3);
    assert!(Univariate::validate(&near).is_ok());
    assert_relative_eq!(near.quantile(0.5), 1e-3 * 0.5f64.powf(1.0 / 500.0), max_relative = 1e-8);
}

/// A truncation of a truncated distribution, with both probabilities below the smallest number, equals the narrower
/// truncation.
#[test]
fn far_truncations_nest() {
    let once = Gamma(2.0, 1.0).truncate(900.0..950.0);
    let twice = Gamma(2.0, 1.0).truncate(800.0..).truncate(900.0..950.0);
    assert!(Univariate::validate(&twice).is_ok());
    for x in [901.0, 905.0, 930.0] {
        let [one, other]: [f64; 2] = [once.ln_density(&x), twice.ln_density(&x)];
        assert_relative_eq!(one, other, max_relative = 1e-12);
        assert_relative_eq!(once.cdf(x), twice.cdf(x), max_relative = 1e-9);
        let [one, other]: [f64; 2] = [once.ln_sf(x), twice.ln_sf(x)];
        assert_relative_eq!(one, other, max_relative = 1e-11);
    }
    assert_relative_eq!(once.quantile(0.4), twice.quantile(0.4), max_relative = 1e-11);
}
