//! Counts and flags.

use ppl::Dual;
use ppl::prelude::*;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{assert_close, derivative};

const DRAWS: usize = 20_000;

#[test]
fn poisson() {
    for rate in [0.3, 7.5, 400.0] {
        let poisson = Poisson(rate);
        let last = (rate + 40.0 * (rate + 1.0).sqrt()) as u64;
        let mass = |k: u64| -> f64 { poisson.ln_density(&k) };
        let masses: Vec<f64> = (0..=last).map(|k| mass(k).exp()).collect();
        let sum = |g: &dyn Fn(f64) -> f64| -> f64 {
            masses.iter().enumerate().map(|(k, p)| p * g(k as f64)).sum()
        };
        assert_close(sum(&|_| 1.0), 1.0, 1e-13, 0.0, "sum");
        assert_close(sum(&|k| k), poisson.mean(), 1e-12, 0.0, "mean");
        let variance = sum(&|k| (k - rate).powi(2));
        assert_close(variance, poisson.variance(), 1e-12, 0.0, "variance");

        for k in [0, 1, 5, rate as u64 * 2 + 3] {
            let name = format!("Poisson({rate}) at {k}");
            let [lifted] = Dual::variables([rate]);
            let got: Dual<1> = Poisson(lifted).ln_density(&k);
            let numerical = derivative(|r| Poisson(r).ln_density(&k), rate, 0.1 * rate);
            assert_close(got.gradient()[0], numerical, 1e-8, 1e-8, &name);
            let k = k as usize;
            let below: f64 = masses[..=k].iter().sum();
            let above: f64 = masses[k + 1..].iter().rev().sum();
            assert_close(poisson.cdf(k as u64), below, 1e-12, 0.0, &name);
            assert_close(poisson.sf(k as u64), above, 1e-12, 0.0, &name);
        }

        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let draws: Vec<u64> =
            (0..DRAWS).map(|_| Distribution::<f64>::draw(&poisson, &mut rng)).collect();
        // χ² over the counts expected at least 20 times, the rest in one cell
        let n = DRAWS as f64;
        let (mut statistic, mut cells, mut rest) = (0.0, 0, (n, n));
        for (k, p) in masses.iter().enumerate().filter(|(_, p)| *p * n >= 20.0) {
            let seen = draws.iter().filter(|&&d| d == k as u64).count() as f64;
            statistic += (seen - n * p).powi(2) / (n * p);
            rest = (rest.0 - seen, rest.1 - n * p);
            cells += 1;
        }
        statistic += (rest.0 - rest.1).powi(2) / rest.1;
        // the 1 − 10⁻⁴ quantile of χ² with that many degrees of freedom (Wilson–Hilferty)
        let degrees = f64::from(cells);
        let ninth = 2.0 / (9.0 * degrees);
        let limit = degrees * (1.0 - ninth + 3.719 * ninth.sqrt()).powi(3);
        assert!(statistic < limit, "Poisson({rate}): {statistic} against {limit}");
    }
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
