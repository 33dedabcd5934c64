//! Conformance tests for distributions of vectors and matrices that can be the prior of an unknown.

use ppl::prelude::*;
use ppl::{CholeskyFactor, Dual, Scalar};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{assert_close, derivative, moments};

/// Dual number with space for coordinates and parameters.
pub(crate) type Lifted = Dual<12>;

/// The numbers in a value, without the entries above the diagonal.
pub(crate) trait Entries<R> {
    fn entries(&self) -> Vec<R>;
}

impl<R: Scalar, const N: usize> Entries<R> for [R; N] {
    fn entries(&self) -> Vec<R> {
        self.to_vec()
    }
}

impl<R: Scalar> Entries<R> for Vec<R> {
    fn entries(&self) -> Vec<R> {
        self.clone()
    }
}

impl<R: Scalar, const K: usize> Entries<R> for CholeskyFactor<R, K> {
    fn entries(&self) -> Vec<R> {
        (0..K).flat_map(|i| (0..=i).map(move |j| self.get(i, j))).collect()
    }
}

/// Results of a family at a point of unconstrained space.
pub(crate) struct Reading<R> {
    pub(crate) entries: Vec<R>,
    /// Log density computed by `constrain`.
    pub(crate) term: R,
    /// Log density computed by `ln_density` from the value.
    pub(crate) ln_density: R,
    /// Coordinates computed by `unconstrain` from the value.
    pub(crate) back: Vec<f64>,
}

/// A family of distributions over any scalar type.
pub(crate) trait Case {
    fn read<R: Scalar>(&self, parameters: &[R], y: &[R], jacobian: bool) -> Reading<R>;

    /// Returns the coordinates of a draw.
    fn draw(&self, parameters: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<f64>;
}

/// Implements [`Case`] for a family over the slice `p` of parameters:
/// `unknown!(Name, |p| Normal(p[0], p[1]).array::<3>().ordered())`.
macro_rules! unknown {
    ($Name:ident, |$p:ident| $distribution:expr) => {
        pub(crate) struct $Name;

        impl $crate::vector_conformance::Case for $Name {
            fn read<R: ppl::Scalar>(
                &self,
                $p: &[R],
                y: &[R],
                jacobian: bool,
            ) -> $crate::vector_conformance::Reading<R> {
                let distribution = $distribution;
                assert_eq!(Unknown::<R>::dim(&distribution), y.len());
                let mut coordinates = y.iter().copied();
                let mut next = || coordinates.next().expect("as many coordinates as dim()");
                let (value, term) =
                    $crate::numerics::constrained(&distribution, &mut next, jacobian);
                assert!(coordinates.next().is_none());
                let mut back = Vec::new();
                Unknown::<R>::unconstrain(&distribution, &value, &mut back);
                $crate::vector_conformance::Reading {
                    entries: $crate::vector_conformance::Entries::entries(&value),
                    term,
                    ln_density: distribution.ln_density(&value),
                    back,
                }
            }

            fn draw(&self, $p: &[f64], rng: &mut rand_xoshiro::Xoshiro256PlusPlus) -> Vec<f64> {
                let distribution = $distribution;
                Distribution::<f64>::validate(&distribution).unwrap();
                let value = Distribution::<f64>::draw(&distribution, rng);
                let mut y = Vec::new();
                Unknown::<f64>::unconstrain(&distribution, &value, &mut y);
                y
            }
        }
    };
}
pub(crate) use unknown;

/// Checks maps, Jacobians and derivatives at `y`, the normalisation and the draws. The entries with the indices `free`
/// determine the other entries of the value.
pub(crate) fn assert_unknown<C: Case>(
    name: &str,
    case: &C,
    parameters: &[f64],
    y: &[f64],
    free: &[usize],
) {
    let plain = case.read(parameters, y, true);
    let without = case.read(parameters, y, false);
    for (back, y) in plain.back.iter().zip(y) {
        assert_close(*back, *y, 1e-10, 1e-10, &format!("coordinates, {name}"));
    }
    assert_close(without.term, plain.ln_density, 1e-12, 1e-12, &format!("two ways, {name}"));
    derivatives(name, case, parameters, y);

    let lifted = lift(case, parameters, y, true);
    let jacobian = nalgebra::DMatrix::from_fn(y.len(), free.len(), |i, j| {
        lifted.entries[free[j]].gradient()[i]
    });
    let expected = jacobian.determinant().abs().ln();
    let log_jacobian = plain.term - without.term;
    assert_close(log_jacobian, expected, 1e-10, 1e-10, &format!("log-Jacobian, {name}"));
    draws(name, case, parameters, y.len());
}

fn lift<C: Case>(case: &C, parameters: &[f64], y: &[f64], jacobian: bool) -> Reading<Lifted> {
    let unit = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
    let number = |(i, &x): (usize, &f64)| Dual::new(x, unit(i));
    let y_lifted: Vec<Lifted> = y.iter().enumerate().map(number).collect();
    let shifted = |(i, &x): (usize, &f64)| Dual::new(x, unit(y.len() + i));
    let parameters: Vec<Lifted> = parameters.iter().enumerate().map(shifted).collect();
    assert!(y.len() + parameters.len() <= 12);
    case.read(&parameters, &y_lifted, jacobian)
}

/// Compares the partial derivatives of the value, of both log densities and of the density with respect to every
/// coordinate and parameter with extrapolated finite differences.
fn derivatives<C: Case>(name: &str, case: &C, parameters: &[f64], y: &[f64]) {
    for jacobian in [true, false] {
        let lifted = lift(case, parameters, y, jacobian);
        let plain = case.read(parameters, y, jacobian);
        assert_close(lifted.term.value(), plain.term, 1e-13, 1e-13, name);
        let outputs = |r: Reading<f64>| [r.entries, vec![r.term, r.ln_density]].concat();
        let duals = [lifted.entries, vec![lifted.term, lifted.ln_density]].concat();
        for i in 0..y.len() + parameters.len() {
            for (o, dual) in duals.iter().enumerate() {
                let moved = |x: f64| {
                    let (mut p, mut y) = (parameters.to_vec(), y.to_vec());
                    if i < y.len() {
                        y[i] = x
                    } else {
                        p[i - y.len()] = x
                    }
                    outputs(case.read(&p, &y, jacobian))[o]
                };
                let at = if i < y.len() { y[i] } else { parameters[i - y.len()] };
                let numerical = derivative(moved, at, 0.02 * at.abs().max(0.2));
                let what = format!("∂ of output {o} in {i}, {name}");
                assert_close(dual.gradient()[i], numerical, 1e-7, 1e-7, &what);
            }
        }
    }
}

const DRAWS: usize = 20_000;

/// Returns the mean and its standard error.
fn estimate(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.collect();
    let (mean, variance) = moments(&values);
    (mean, (variance / values.len() as f64).sqrt())
}

/// Checks ∫ p(y) dy = E[p/q] over draws from q, which are independent Student t draws with 3 degrees of freedom. Also
/// compares expectations of bounded functions with these weights with expectations over draws from p. All differences
/// must be below 4.5 standard errors.
fn draws<C: Case>(name: &str, case: &C, parameters: &[f64], dim: usize) {
    let proposal = StudentT(3.0, 0.0, 1.2);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let weighted: Vec<(Vec<f64>, f64)> = (0..DRAWS)
        .map(|_| {
            let y: Vec<f64> = (0..dim).map(|_| proposal.draw(&mut rng)).collect();
            let ln_q: f64 = y.iter().map(|y| -> f64 { proposal.ln_density(y) }).sum();
            let weight = (case.read(parameters, &y, true).term - ln_q).exp();
            (y, weight)
        })
        .collect();
    let (total, error) = estimate(weighted.iter().map(|(_, w)| *w));
    assert!(error < 0.1, "{name}: standard error {error}");
    assert_close(total, 1.0, 0.0, 4.5 * error, &format!("∫p, {name}"));

    let drawn: Vec<Vec<f64>> = (0..DRAWS).map(|_| case.draw(parameters, &mut rng)).collect();
    for (i, j) in (0..dim).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let functions: [fn(f64, f64) -> f64; 2] =
            [|a, b| a.tanh() * b.tanh(), |a, b| (2.0 * (a + b)).tanh()];
        for f in functions {
            let (by_weights, e1) = estimate(weighted.iter().map(|(y, w)| w * f(y[i], y[j])));
            let (by_draws, e2) = estimate(drawn.iter().map(|y| f(y[i], y[j])));
            let what = format!("E f(y[{i}], y[{j}]), {name}");
            assert_close(by_draws, by_weights, 0.0, 4.5 * e1.hypot(e2), &what);
        }
    }
}
