//! Proposal distribution of the random-walk samplers and its adaptation in the warmup.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::model::erased::ErasedDensity;
use crate::model::start::prior_scales;
use crate::sampler::draws::report::{InverseMassMatrix, WarmupReport};
use crate::sampler::hamiltonian::warmup::{Moment, WindowSchedule, walk_windows};
use crate::sampler::run::settings::Settings;
use crate::sampler::run::stream::Stream;

/// Generator of random-walk proposals, with scratch memory.
pub(crate) struct Proposal {
    noise: DVector<f64>,
    jump: DVector<f64>,
    pub(crate) shape: ProposalShape,
}

impl Proposal {
    pub(crate) fn new(shape: ProposalShape) -> Self {
        let dim = shape.factor.nrows();
        Self { noise: DVector::zeros(dim), jump: DVector::zeros(dim), shape }
    }

    /// Draws a proposal around the point `from` and writes it to `to`.
    pub(crate) fn propose(&mut self, from: &[f64], to: &mut [f64], rng: &mut Stream) {
        self.noise.iter_mut().for_each(|z| *z = rng.sample(StandardNormal));
        self.jump.gemv(self.shape.scale, &self.shape.factor, &self.noise, 0.0);
        for ((new, old), jump) in to.iter_mut().zip(from).zip(&self.jump) {
            *new = old + jump;
        }
    }
}

/// Shape of the proposal `Normal(y, s² Σ)`: Σ is estimated from windows of draws, and s is tuned to the target
/// acceptance; see [`Metropolis`](crate::Metropolis).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ProposalShape {
    /// Cholesky factor of Σ.
    factor: DMatrix<f64>,
    pub(crate) scale: f64,
    /// Number of warmup transitions since the scale was last reset.
    steps: f64,
    schedule: WindowSchedule,
    window: Scatter,
}

impl ProposalShape {
    /// Creates the initial shape from the scales of the prior. The prior is sampled with a random stream that no
    /// chain uses.
    pub(crate) fn new(density: &dyn ErasedDensity, settings: &Settings<'_>) -> Self {
        let mut rng = Stream::seed_from_u64(settings.seed);
        rng.long_jump();
        let scales = prior_scales(density, &mut rng);
        Self::with_scales(scales.unwrap_or_else(|| vec![1.0; density.dim()]), settings.warmup)
    }

    fn with_scales(scales: Vec<f64>, warmup: usize) -> Self {
        let dim = scales.len();
        Self {
            factor: DMatrix::from_diagonal(&DVector::from_vec(scales)),
            scale: first_scale(dim),
            steps: 0.0,
            schedule: WindowSchedule::new(warmup, walk_windows),
            window: Scatter::new(dim),
        }
    }

    /// Adapts scale and covariance after a warmup transition that ended at `y` with the acceptance probability
    /// `acceptance`.
    pub(crate) fn learn(&mut self, acceptance: f64, y: &[f64]) {
        let dim = y.len();
        self.steps += 1.0;
        self.scale *= (self.steps.powf(-0.6) * (acceptance - target_acceptance(dim))).exp();
        let moment = self.schedule.pass();
        if matches!(moment, Moment::Inside | Moment::Last { .. }) {
            self.window.add(y);
        }
        if matches!(moment, Moment::Last { .. }) {
            // if one coordinate is constant in the window, the covariance is singular, and the old factor is kept
            if let Some(factor) = Cholesky::new(self.window.covariance()) {
                self.factor = factor.unpack();
                self.scale = first_scale(dim);
                self.steps = 0.0;
            }
            self.window = Scatter::new(dim);
        }
    }

    /// Writes the tuned proposal to the warmup report.
    pub(crate) fn report(&self, report: &mut WarmupReport) {
        report.step_size = self.scale;
        report.target_acceptance = target_acceptance(self.factor.nrows());
        report.windows = self.schedule.passed.clone();
        let covariance = &self.factor * self.factor.transpose();
        report.covariance = InverseMassMatrix::Dense(covariance.as_slice().to_vec());
    }

    /// Whether the shape has `dim` coordinates and has been adapted `transitions` times, once after
    /// each transition.
    pub(crate) fn fits(&self, dim: usize, transitions: usize) -> bool {
        self.factor.shape() == (dim, dim)
            && self.window.mean.len() == dim
            && self.window.scatter.shape() == (dim, dim)
            && self.schedule.has_passed(transitions)
    }
}

/// Optimal scale s of the proposal for a normal density with known covariance, in `dim` dimensions.
pub(crate) fn first_scale(dim: usize) -> f64 {
    2.38 / (dim.max(1) as f64).sqrt()
}

/// Optimal acceptance probability of a random walk: 0.44 in one dimension, 0.234 in the limit of many dimensions.
pub(crate) fn target_acceptance(dim: usize) -> f64 {
    0.234 + 0.206 / dim.max(1) as f64
}

/// Running mean and scatter matrix of vectors (Welford's algorithm).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Scatter {
    count: f64,
    mean: DVector<f64>,
    scatter: DMatrix<f64>,
}

impl Scatter {
    pub(crate) fn new(dim: usize) -> Self {
        Self { count: 0.0, mean: DVector::zeros(dim), scatter: DMatrix::zeros(dim, dim) }
    }

    pub(crate) fn add(&mut self, y: &[f64]) {
        self.count += 1.0;
        let delta = DVector::from_column_slice(y) - &self.mean;
        self.mean.axpy(1.0 / self.count, &delta, 1.0);
        self.scatter.ger(1.0 - 1.0 / self.count, &delta, &delta, 1.0);
    }

    /// Sample covariance of the n vectors, with correlations shrunk by the factor n/(n+5).
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
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

    /// Compares the covariance of three points from `Scatter` with the two-pass formula.
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
