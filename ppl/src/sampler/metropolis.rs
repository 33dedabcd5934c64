//! Adaptive random-walk Metropolis.

use std::sync::atomic::AtomicBool;

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::Rng;
use rand_distr::StandardNormal;

use super::{
    chains::{Chains, Covariance, DrawStats, WarmupReport},
    error::SampleError,
    progress::Progress,
    rejections::{Rejections, Stop},
    run::{Kernel, Stream},
    settings::{Init, Run, shared_settings},
    warmup::{Moment, Schedule, walk_windows},
};
use crate::{
    bound::Bound,
    density::{LogDensity, Rejection},
    model::Model,
    posterior::Posterior,
};

/// Random-walk Metropolis that learns its proposal `Normal(y, s² Σ)` in the warmup.
///
/// Needs no gradient. Σ is the covariance of the draws of the last of several windows, which
/// double from 100 draws between the first 10 % and the last 25 % of the warmup; its correlations
/// are shrunk by n/(n+5), so that it is positive definite from any number n of draws. The scale s
/// begins at 2.38/√d with every window, and `ln s ← ln s + k^−0.6 (a − a*)` leads the acceptance
/// a to `a* = 0.234 + 0.206/d` (Robbins & Monro). After the warmup nothing is adapted, so that the
/// kept draws are an ordinary Markov chain. The cost of an effective draw grows with d; prefer
/// [`Nuts`](super::Nuts) where there are gradients.
///
/// Statistics of a draw: `leapfrogs` is 1, `depth` 0, `step_size` s, `energy` −ln p.
///
/// # Errors
/// [`SampleError`] if a setting is out of range or a chain finds no starting point.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn counts(counts: &[u64]) {
///         let rate ~ Gamma(2.0, 0.5);
///         for count in counts {
///             count ~ Poisson(rate);
///         }
///     }
/// }
///
/// let sampler = Metropolis::default().chains(2).draws(2000).thin(5).seed(7);
/// let posterior = sampler.sample(&counts(&[4, 7, 2, 5]))?;
/// // conjugate: Gamma(2 + 18, 0.5 + 4)
/// ppl::check::mean(&posterior, "rate", 20.0 / 4.5).within_mcse(4.0);
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// # References
/// Haario, Saksman & Tamminen, Bernoulli 7 (2001) 223; Andrieu & Thoms, Statistics and Computing
/// 18 (2008) 343, algorithm 4; Gelman, Roberts & Gilks, *Bayesian Statistics 5* (1996) 599 for
/// scale and acceptance.
#[derive(Clone)]
pub struct Metropolis<'a> {
    run: Run<'a>,
}

impl Default for Metropolis<'_> {
    fn default() -> Self {
        Self { run: Run::new(5000, 10_000) }
    }
}

impl<'a> Metropolis<'a> {
    shared_settings!();

    /// Samples any log density; its gradient is not asked for.
    ///
    /// # Errors
    /// See [`Metropolis`].
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Chains, SampleError> {
        let dim = density.dim();
        let chains = self.run.execute(dim, || MetropolisChain::new(density, self.run.warmup))?;
        Ok(Chains { dim, chains, max_depth: None })
    }

    /// Samples a model: the draws with everything the model names.
    ///
    /// # Errors
    /// See [`Metropolis`]; also if the model cannot be evaluated, or a chain was stopped before its first
    /// draw.
    pub fn sample<M: Model>(&self, model: &Bound<M>) -> Result<Posterior, SampleError> {
        model.layout()?;
        Ok(Posterior::from_chains(model, self.run(model)?, self.run.seed)?)
    }
}

struct MetropolisChain<'a, D: LogDensity> {
    density: &'a D,
    workspace: D::Workspace,
    y: Vec<f64>,
    log_density: f64,
    proposal: Vec<f64>,
    noise: DVector<f64>,
    jump: DVector<f64>,
    /// Cholesky factor of Σ.
    factor: DMatrix<f64>,
    scale: f64,
    /// Warmup transitions since the scale began anew.
    steps: f64,
    schedule: Schedule,
    window: Scatter,
    rejections: Rejections,
}

impl<'a, D: LogDensity> MetropolisChain<'a, D> {
    fn new(density: &'a D, warmup: usize) -> Self {
        let dim = density.dim();
        Self {
            density,
            workspace: D::Workspace::default(),
            y: vec![0.0; dim],
            log_density: f64::NEG_INFINITY,
            proposal: vec![0.0; dim],
            noise: DVector::zeros(dim),
            jump: DVector::zeros(dim),
            factor: DMatrix::identity(dim, dim),
            scale: first_scale(dim),
            steps: 0.0,
            schedule: Schedule::new(warmup, walk_windows),
            window: Scatter::new(dim),
            rejections: Rejections::default(),
        }
    }
}

/// Best scale for a normal target whose covariance is known.
fn first_scale(dim: usize) -> f64 {
    2.38 / (dim.max(1) as f64).sqrt()
}

/// Best acceptance: 0.44 for one coordinate, 0.234 for many.
fn target_acceptance(dim: usize) -> f64 {
    0.234 + 0.206 / dim.max(1) as f64
}

impl<D: LogDensity> Kernel for MetropolisChain<'_, D> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.y.copy_from_slice(y);
        self.log_density = self.density.log_density(y, &mut self.workspace)?;
        Ok(())
    }

    fn prepare(&mut self, _: &mut Stream) -> Result<(), Stop> {
        Ok(())
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, Stop> {
        self.noise.iter_mut().for_each(|z| *z = rng.sample(StandardNormal));
        self.jump.gemv(self.scale, &self.factor, &self.noise, 0.0);
        for ((new, old), jump) in self.proposal.iter_mut().zip(&self.y).zip(&self.jump) {
            *new = old + jump;
        }
        let proposed = match self.density.log_density(&self.proposal, &mut self.workspace) {
            Ok(value) => value,
            Err(rejection) => {
                self.rejections.count(&rejection)?;
                f64::NEG_INFINITY
            }
        };
        let acceptance = (proposed - self.log_density).exp().min(1.0);
        if rng.random::<f64>() < acceptance {
            std::mem::swap(&mut self.y, &mut self.proposal);
            self.log_density = proposed;
        }
        Ok(DrawStats {
            log_density: self.log_density,
            energy: -self.log_density,
            acceptance,
            step_size: self.scale,
            depth: 0,
            leapfrogs: 1,
            divergent: false,
            tuning: false,
        })
    }

    fn adapt(&mut self, stats: &DrawStats, _: &mut Stream) -> Result<(), Stop> {
        let dim = self.y.len();
        self.steps += 1.0;
        self.scale *= (self.steps.powf(-0.6) * (stats.acceptance - target_acceptance(dim))).exp();
        let moment = self.schedule.pass();
        if matches!(moment, Moment::Inside | Moment::Last { .. }) {
            self.window.add(&self.y);
        }
        if matches!(moment, Moment::Last { .. }) {
            // a window in which a coordinate never moved has no covariance: keep the old one
            if let Some(factor) = Cholesky::new(self.window.covariance()) {
                self.factor = factor.unpack();
                self.scale = first_scale(dim);
                self.steps = 0.0;
            }
            self.window = Scatter::new(dim);
        }
        Ok(())
    }

    fn freeze(&mut self, report: &mut WarmupReport) {
        report.step_size = self.scale;
        report.target_acceptance = target_acceptance(self.y.len());
        report.windows = self.schedule.passed.clone();
        let covariance = &self.factor * self.factor.transpose();
        report.covariance = Covariance::Dense(covariance.as_slice().to_vec());
    }

    fn position(&self) -> &[f64] {
        &self.y
    }

    fn divergence(&self) -> (&[f64], f64) {
        (&self.y, 0.0)
    }

    fn rejections(&mut self) -> &mut Rejections {
        &mut self.rejections
    }
}

/// Mean and scatter matrix of vectors seen one by one.
struct Scatter {
    count: f64,
    mean: DVector<f64>,
    scatter: DMatrix<f64>,
}

impl Scatter {
    fn new(dim: usize) -> Self {
        Self { count: 0.0, mean: DVector::zeros(dim), scatter: DMatrix::zeros(dim, dim) }
    }

    fn add(&mut self, y: &[f64]) {
        self.count += 1.0;
        let delta = DVector::from_column_slice(y) - &self.mean;
        self.mean.axpy(1.0 / self.count, &delta, 1.0);
        self.scatter.ger(1.0 - 1.0 / self.count, &delta, &delta, 1.0);
    }

    /// Covariance with correlations shrunk by n/(n+5).
    fn covariance(&self) -> DMatrix<f64> {
        let n = self.count;
        let unshrunk = &self.scatter / (n - 1.0);
        let mut covariance = &unshrunk * (n / (n + 5.0));
        covariance.set_diagonal(&unshrunk.diagonal());
        covariance
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Against the two-pass formula on three points.
    #[test]
    fn scatter_by_hand() {
        let mut scatter = Scatter::new(2);
        for y in [[1.0, 2.0], [3.0, -1.0], [5.0, 5.0]] {
            scatter.add(&y);
        }
        let covariance = scatter.covariance();
        assert_relative_eq!(covariance[(0, 0)], 4.0, max_relative = 1e-14);
        assert_relative_eq!(covariance[(1, 1)], 9.0, max_relative = 1e-14);
        assert_relative_eq!(covariance[(0, 1)], 3.0 * 3.0 / 8.0, max_relative = 1e-14);
    }
}
