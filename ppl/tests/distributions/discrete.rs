//! Counts and flags.

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

/// ln(1 − p) and 1/(1 − p) at the ends of the probability.
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
