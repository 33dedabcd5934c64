//! Distributions of counts and flags.

use ppl::Dual;
use ppl::prelude::*;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::counts::assert_counts;
use crate::numerics::{assert_close, derivative};

const DRAWS: usize = 20_000;

#[test]
fn poisson() {
    assert_counts!([l] Poisson(l), [0.3], 40);
    assert_counts!([l] Poisson(l), [7.5], 100);
    assert_counts!([l] Poisson(l), [400.0], 1200);
    assert_counts!([e] PoissonLog(e), [1.7], 90);
}

#[test]
fn binomial() {
    assert_counts!([p] Binomial(12u64, p), [0.3], 12);
    assert_counts!([p] Binomial(500u64, p), [0.98], 500);
    assert_counts!([x] BinomialLogit(12u64, x), [-0.8], 12);
    assert_counts!([x] BinomialLogit(60u64, x), [3.0], 60);
}

#[test]
fn mixtures() {
    assert_counts!(
        [w, a, b] Mixture([w, 1.0 - w], [Poisson(a), Poisson(b)]), [0.3, 1.5, 9.0], 90,
        without moments);
}

/// ln(1 − p) and 1/(1 − p) at the probabilities 0 and 1.
#[test]
fn certain_trials() {
    let certain: [f64; 5] = [
        Binomial(5u64, 0.0).ln_density(&0),
        Binomial(5u64, 1.0).ln_density(&5),
        Binomial(0u64, 0.3).ln_density(&0),
        Binomial(5u64, 0.0).ln_density(&1),
        Binomial(5u64, 0.3).ln_density(&6),
    ];
    let nothing = f64::NEG_INFINITY;
    assert_eq!(certain, [0.0, 0.0, 0.0, nothing, nothing]);
    let [p] = Dual::variables([0.0]);
    let slope: Dual<1> = Binomial(5u64, p).ln_density(&0);
    assert_eq!(slope.gradient(), [-5.0]);
}

/// Probabilities p for which p or 1 − p underflows; reference values of mpmath 1.3 with 60 digits.
#[test]
fn binomial_of_extreme_logits() {
    let cases = [
        (1u64, 820.362, 0, -820.362),
        (1, -820.362, 1, -820.362),
        (1, 820.362, 1, 0.0),
        (12, 745.5, 5, -5_211.825_438_608_186),
        (12, -709.5, 5, -3_540.825_438_608_186),
        (500, -1e6, 250, -249_999_656.760_005_12),
        (3, 800.0, 3, 0.0),
    ];
    for (n, logit, k, expected) in cases {
        let [x] = Dual::variables([logit]);
        let got: Dual<1> = BinomialLogit(n, x).ln_density(&k);
        assert_close(got.value(), expected, 1e-15, 0.0, &format!("{k} of {n} at {logit}"));
        let slope = if logit > 0.0 { k as f64 - n as f64 } else { k as f64 };
        assert_close(got.gradient()[0], slope, 1e-15, 0.0, "slope");
    }
}

ppl::model! {
    /// Counts of which a fraction is zero for another reason.
    fn zero_inflated(counts: &[u64]) {
        let absent ~ Beta(1.0, 1.0);
        let rate ~ Gamma(2.0, 0.5);
        for k in counts {
            k ~ Mixture([absent, 1.0 - absent], [Poisson(0.0 * rate), Poisson(rate)]);
        }
    }

    fn zero_inflated_by_hand(counts: &[u64]) {
        let absent ~ Beta(1.0, 1.0);
        let rate ~ Gamma(2.0, 0.5);
        for k in counts {
            if *k == 0 {
                factor((absent + (1.0 - absent) * (-rate).exp()).ln());
            } else {
                factor((1.0 - absent).ln() + Poisson(rate).ln_density(k));
            }
        }
    }

    /// Version of `zero_inflated` with a binomial distribution, and with `ln_sum_exp` instead of `Mixture`.
    fn zero_inflated_trials(counts: &[u64]) {
        let absent ~ Beta(1.0, 1.0);
        let p ~ Beta(2.0, 2.0);
        for k in counts {
            let none = absent.ln() + Binomial(9u64, 0.0 * p).ln_density(k);
            factor(ln_sum_exp(&[none, (1.0 - absent).ln() + Binomial(9u64, p).ln_density(k)]));
        }
    }
}

/// At rate 0, every count is 0. Value and gradient of a mixture with this distribution are not NaN.
#[test]
fn counts_are_zero_at_rate_zero() {
    assert!(Distribution::<f64>::validate(&Poisson(0.0)).is_ok());
    let masses: [f64; 3] = [0u64, 1, 7].map(|k| Poisson(0.0).ln_density(&k));
    assert_eq!(masses, [0.0, f64::NEG_INFINITY, f64::NEG_INFINITY]);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    assert_eq!(Distribution::<f64>::draw(&Poisson(0.0), &mut rng), 0);

    let counts = [0, 3, 0, 1, 0, 5];
    let (model, by_hand) = (zero_inflated(&counts), zero_inflated_by_hand(&counts));
    let mut work = ppl::Workspace::default();
    for point in [[0.3, 0.7], [-1.5, 1.2], [2.0, -0.4]] {
        let (mut one, mut other) = ([0.0; 2], [0.0; 2]);
        let value = model.gradient(&point, &mut one, &mut work).expect("a density");
        let expected = by_hand.gradient(&point, &mut other, &mut work).expect("a density");
        assert_close(value, expected, 1e-13, 0.0, "zero-inflated counts");
        for (got, expected) in one.into_iter().zip(other) {
            assert_close(got, expected, 1e-12, 1e-12, "gradient");
        }
    }
    ppl::check::gradient(&model, 7);
    ppl::check::gradient(&zero_inflated_trials(&counts), 7);
}

#[test]
fn bernoulli_logit() {
    for x in [-40.0, -1.2, 0.0, 3.0, 800.0] {
        for flag in [true, false] {
            let [lifted] = Dual::variables([x]);
            let got: Dual<1> = BernoulliLogit(lifted).ln_density(&flag);
            let sign = if flag { 1.0 } else { -1.0f64 };
            let expected = if sign * x > -700.0 { -(-sign * x).exp().ln_1p() } else { sign * x };
            assert_close(got.value(), expected, 1e-15, 0.0, "value");
            let numerical = derivative(|x| BernoulliLogit(x).ln_density(&flag), x, 0.1);
            assert_close(got.gradient()[0], numerical, 1e-8, 1e-12, "∂x");
        }
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let flag = BernoulliLogit(0.4);
    let heads = (0..DRAWS).filter(|_| Distribution::<f64>::draw(&flag, &mut rng)).count() as f64;
    let n = DRAWS as f64;
    let error = (flag.variance() / n).sqrt();
    assert_close(heads / n, flag.mean(), 0.0, 4.0 * error, "share of heads");
}

#[test]
fn bernoulli() {
    let p = 0.3;
    let total: f64 = [true, false]
        .iter()
        .map(|flag| -> f64 { Distribution::<f64>::ln_density(&Bernoulli(p), flag).exp() })
        .sum();
    assert_close(total, 1.0, 1e-15, 0.0, "sum");
    assert_eq!((Bernoulli(p).mean(), Bernoulli(p).variance()), (0.3, 0.3 * 0.7));
    for flag in [true, false] {
        let [lifted] = Dual::variables([p]);
        let got: Dual<1> = Bernoulli(lifted).ln_density(&flag);
        let numerical = derivative(|p| Bernoulli(p).ln_density(&flag), p, 0.02);
        assert_close(got.gradient()[0], numerical, 1e-8, 0.0, "∂p");
    }
    let certain: [f64; 2] = [0.0, 1.0].map(|p| Bernoulli(p).ln_density(&true));
    assert_eq!(certain, [f64::NEG_INFINITY, 0.0]);
    for outside in [-0.1, 1.1, f64::NAN] {
        for flag in [true, false] {
            let ln_density: f64 = Bernoulli(outside).ln_density(&flag);
            assert!(ln_density.is_nan());
        }
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let heads =
        (0..DRAWS).filter(|_| Distribution::<f64>::draw(&Bernoulli(p), &mut rng)).count() as f64;
    let n = DRAWS as f64;
    assert_close(heads / n, p, 0.0, 4.0 * (p * (1.0 - p) / n).sqrt(), "share of heads");
}
