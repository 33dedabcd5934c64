//! Densities with known moments.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};
use ppl::{Chains, Location, LogDensity, Rejection, diagnostics::mcse_mean};

/// A normal density with given mean and covariance.
pub(crate) struct Gaussian {
    pub(crate) mean: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
    precision: DMatrix<f64>,
}

impl Gaussian {
    /// Correlation ρ^|i−j| (an autoregression), standard deviations from `least` to `largest`.
    pub(crate) fn autoregressive(dim: usize, rho: f64, least: f64, largest: f64) -> Self {
        Self::with_correlations(dim, |i, j| rho.powi(i.abs_diff(j) as i32), least, largest)
    }

    /// All correlations ρ, standard deviations from `least` to `largest`.
    pub(crate) fn equicorrelated(dim: usize, rho: f64, least: f64, largest: f64) -> Self {
        Self::with_correlations(dim, |i, j| if i == j { 1.0 } else { rho }, least, largest)
    }

    fn with_correlations(
        dim: usize,
        correlation: impl Fn(usize, usize) -> f64,
        least: f64,
        largest: f64,
    ) -> Self {
        let sd = |i: usize| least * (largest / least).powf(i as f64 / (dim - 1).max(1) as f64);
        let covariance = DMatrix::from_fn(dim, dim, |i, j| correlation(i, j) * sd(i) * sd(j));
        let precision = covariance.clone().try_inverse().expect("positive definite");
        Self { mean: DVector::from_fn(dim, |i, _| i as f64 - 1.0), covariance, precision }
    }
}

impl LogDensity for Gaussian {
    type Workspace = ();

    fn dim(&self) -> usize {
        self.mean.len()
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        let z = DVector::from_column_slice(y) - &self.mean;
        Ok(-0.5 * z.dot(&(&self.precision * &z)))
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        let z = DVector::from_column_slice(y) - &self.mean;
        g.copy_from_slice((-&self.precision * z).as_slice());
        self.log_density(y, w)
    }
}

/// A density given by a function that writes the gradient and returns the value.
pub(crate) struct Function<F> {
    pub(crate) dim: usize,
    pub(crate) function: F,
}

impl<F> LogDensity for Function<F>
where
    F: Fn(&[f64], &mut [f64]) -> Result<f64, Rejection> + Sync,
{
    type Workspace = Vec<f64>;

    fn dim(&self) -> usize {
        self.dim
    }

    fn log_density(&self, y: &[f64], scratch: &mut Vec<f64>) -> Result<f64, Rejection> {
        scratch.resize(self.dim, 0.0);
        (self.function)(y, scratch)
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], _: &mut Vec<f64>) -> Result<f64, Rejection> {
        (self.function)(y, g)
    }
}

/// A density that calls `then` at every evaluation from index `at` on.
pub(crate) fn until(
    density: &impl LogDensity<Workspace: Default>,
    at: usize,
    then: impl Fn() -> Result<(), Rejection> + Sync,
) -> impl LogDensity {
    let function = |y: &[f64], g: &mut [f64]| density.gradient(y, g, &mut Default::default());
    watched(density.dim(), function, at, then)
}

/// A standard normal density in `dim` dimensions that calls `then` at every evaluation from index `at` on.
pub(crate) fn normal_until(
    dim: usize,
    at: usize,
    then: impl Fn() -> Result<(), Rejection> + Sync,
) -> impl LogDensity {
    let normal = |y: &[f64], g: &mut [f64]| {
        y.iter().zip(g).for_each(|(y, g)| *g = -y);
        Ok(-0.5 * y.iter().map(|y| y * y).sum::<f64>())
    };
    watched(dim, normal, at, then)
}

fn watched(
    dim: usize,
    gradient: impl Fn(&[f64], &mut [f64]) -> Result<f64, Rejection> + Sync,
    at: usize,
    then: impl Fn() -> Result<(), Rejection> + Sync,
) -> impl LogDensity {
    let evaluations = AtomicUsize::new(0);
    let function = move |y: &[f64], g: &mut [f64]| {
        if evaluations.fetch_add(1, Ordering::Relaxed) >= at {
            then()?;
        }
        gradient(y, g)
    };
    Function { dim, function }
}

/// The location of the statement that test densities report when they reject a point.
pub(crate) const WALL: Location = Location { statement: "y > 0", file: "targets.rs", line: 1 };

/// The half-normal density |Normal(0, 1)|, which rejects y ≤ 0.
pub(crate) fn half_normal() -> impl LogDensity {
    let function = |y: &[f64], g: &mut [f64]| {
        if y[0] <= 0.0 {
            return Err(Rejection::NotFinite { location: WALL, value: f64::NEG_INFINITY });
        }
        g[0] = -y[0];
        Ok(-0.5 * y[0] * y[0])
    };
    Function { dim: 1, function }
}

/// Values of `statistic` at every draw, one list per chain.
pub(crate) fn traces(chains: &Chains, statistic: impl Fn(&[f64]) -> f64) -> Vec<Vec<f64>> {
    let trace = |draws: &[f64]| draws.chunks_exact(chains.dim).map(&statistic).collect();
    chains.chains.iter().map(|chain| trace(&chain.draws)).collect()
}

/// Mean of a statistic and its Monte Carlo standard error.
pub(crate) fn mean_and_error(chains: &Chains, statistic: impl Fn(&[f64]) -> f64) -> (f64, f64) {
    let traces = traces(chains, statistic);
    let slices: Vec<&[f64]> = traces.iter().map(Vec::as_slice).collect();
    let all = traces.concat();
    (all.iter().sum::<f64>() / all.len() as f64, mcse_mean(&slices))
}

/// Asserts that a mean lies within 4 standard errors of the truth.
#[track_caller]
pub(crate) fn assert_mean(
    name: &str,
    chains: &Chains,
    truth: f64,
    statistic: impl Fn(&[f64]) -> f64,
) {
    let (mean, error) = mean_and_error(chains, statistic);
    assert!((mean - truth).abs() < 4.0 * error, "{name}: {mean} ± {error}, exactly {truth}");
}

/// Asserts that all means and second central moments agree with a Gaussian target.
#[track_caller]
pub(crate) fn assert_gaussian_moments(target: &Gaussian, chains: &Chains) {
    for i in 0..chains.dim {
        assert_mean(&format!("mean {i}"), chains, target.mean[i], |y| y[i]);
        for j in 0..=i {
            let (a, b) = (target.mean[i], target.mean[j]);
            let name = format!("covariance {i} {j}");
            assert_mean(&name, chains, target.covariance[(i, j)], |y| (y[i] - a) * (y[j] - b));
        }
    }
}

/// A mixture of standard normals around (`at`, …, `at`) with probability `weight` and around its negative.
pub(crate) fn two_modes(dim: usize, at: f64, weight: f64) -> impl LogDensity {
    let function = move |y: &[f64], g: &mut [f64]| {
        let (mut plus, mut minus) = (weight.ln(), (1.0 - weight).ln());
        for y in y {
            plus -= 0.5 * (y - at).powi(2);
            minus -= 0.5 * (y + at).powi(2);
        }
        let share = 1.0 / (1.0 + (minus - plus).exp());
        y.iter().zip(g).for_each(|(y, g)| *g = at * (2.0 * share - 1.0) - y);
        Ok(plus.max(minus) + (-(plus - minus).abs()).exp().ln_1p())
    };
    Function { dim, function }
}
