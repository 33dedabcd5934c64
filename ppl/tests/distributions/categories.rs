//! Categories.

use ppl::prelude::*;
use ppl::special::regularised_gamma;
use ppl::{Dual, Scalar};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{assert_close, derivative};

/// Masses sum to one, and 20 000 draws have them: χ² at α = 10⁻⁴.
fn assert_masses<D: Distribution<f64, Value: PartialEq>>(
    name: &str,
    distribution: &D,
    values: &[D::Value],
) {
    const DRAWS: usize = 20_000;
    distribution.validate().unwrap();
    let masses: Vec<f64> = values.iter().map(|k| distribution.ln_density(k).exp()).collect();
    assert_close(masses.iter().sum(), 1.0, 1e-13, 0.0, &format!("sum of masses, {name}"));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut counts = vec![0usize; values.len()];
    for _ in 0..DRAWS {
        let draw = distribution.draw(&mut rng);
        counts[values.iter().position(|k| *k == draw).expect("a possible value")] += 1;
    }
    let statistic: f64 = counts
        .iter()
        .zip(&masses)
        .map(|(&count, mass)| {
            let expected = DRAWS as f64 * mass;
            assert!(expected > 5.0, "{name}: too rare for a χ² test");
            (count as f64 - expected).powi(2) / expected
        })
        .sum();
    let tail = regularised_gamma(0.5 * (values.len() - 1) as f64, 0.5 * statistic).1;
    assert!(tail > 1e-4, "{name}: χ² {statistic}, P {tail:e}");
}

/// A log mass over numbers of any kind.
trait Mass {
    fn ln_mass<R: Scalar>(&self, parameters: [R; 4]) -> R;
}

/// Partials in four parameters against differences.
fn assert_partials(name: &str, mass: &impl Mass, at: [f64; 4]) {
    let got = mass.ln_mass(Dual::variables(at));
    assert_close(got.value(), mass.ln_mass(at), 1e-14, 1e-14, name);
    for i in 0..4 {
        let moved = |x: f64| {
            let mut p = at;
            p[i] = x;
            mass.ln_mass(p)
        };
        let expected = derivative(moved, at[i], 0.01);
        assert_close(got.gradient()[i], expected, 1e-8, 1e-8, &format!("∂{i}, {name}"));
    }
}

#[test]
fn categorical() {
    let p = [0.1, 0.4, 0.2, 0.3];
    assert_masses("probabilities", &Categorical(p), &[0, 1, 2, 3]);
    let logits = p.map(|p: f64| p.ln() + 7.0);
    assert_masses("logits", &CategoricalLogit(&logits[..]), &[0, 1, 2, 3]);
    for k in 0..4 {
        let (by_p, by_logit): (f64, f64) =
            (Categorical(p).ln_density(&k), CategoricalLogit(logits).ln_density(&k));
        assert_close(by_p, by_logit, 1e-14, 1e-14, "both ways");
    }
    let far: f64 = CategoricalLogit([-1000.0, 0.0]).ln_density(&0);
    assert_eq!(far, -1000.0);
    let outside: [f64; 2] =
        [Categorical(p).ln_density(&4), CategoricalLogit(logits).ln_density(&u64::MAX)];
    assert_eq!(outside, [f64::NEG_INFINITY; 2]);

    struct Probability(u64);
    impl Mass for Probability {
        fn ln_mass<R: Scalar>(&self, p: [R; 4]) -> R {
            Categorical(p).ln_density(&self.0)
        }
    }
    struct Logit(u64);
    impl Mass for Logit {
        fn ln_mass<R: Scalar>(&self, p: [R; 4]) -> R {
            CategoricalLogit(p.to_vec()).ln_density(&self.0)
        }
    }
    for k in 0..4 {
        assert_partials("probabilities", &Probability(k), p);
        assert_partials("logits", &Logit(k), [0.3, -1.0, 2.0, 0.5]);
    }
    let error = Distribution::<f64>::validate(&Categorical([0.5, 0.6])).unwrap_err();
    assert_eq!(error.to_string(), "Categorical: sum of the probabilities must be 1, got 1.1");
}
