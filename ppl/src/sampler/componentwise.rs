//! Metropolis one coordinate at a time.

use std::sync::atomic::AtomicBool;

use rand::Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::{
    chains::{Chains, Covariance, DrawStats, WarmupReport},
    earlier::another_sampler,
    error::SampleError,
    progress::Progress,
    rejections::{Rejections, Stop, accepting, finite},
    run::{Kernel, Stream},
    settings::{Init, Run, shared_settings},
    tuning::Tuning,
};
use crate::{
    any::{AnyDensity, Evaluator},
    bound::Bound,
    density::{LogDensity, Rejection},
    model::Model,
    posterior::Posterior,
};

/// Acceptance that is best for a proposal of one coordinate.
const TARGET: f64 = 0.44;

/// Metropolis that moves one coordinate after the other, each with a scale of its own.
///
/// A transition is a sweep: for i = 1 … d, `y_i` is proposed as `Normal(y_i, s_i²)` and accepted
/// or not, so it costs d evaluations of the density. In the warmup `ln s_i ← ln s_i +
/// k^−0.6 (a_i − 0.44)` leads the acceptance of every coordinate to 0.44 (Robbins & Monro);
/// afterwards nothing is adapted. Needs no gradient, and no shape has to be learned: it is at its
/// best where scales differ by orders and coordinates hardly depend on each other. Strong
/// correlations slow it down, more than [`Metropolis`](super::Metropolis).
///
/// Statistics of a draw: `acceptance` is the mean over the coordinates, `leapfrogs` d, `depth` 0,
/// `step_size` 1, `energy` −ln p. The frozen `s_i²` are the diagonal in
/// [`WarmupReport::covariance`].
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
/// let sampler = ComponentwiseMetropolis::default().chains(2).seed(7);
/// let posterior = sampler.sample(&counts(&[4, 7, 2, 5]))?;
/// // conjugate: Gamma(2 + 18, 0.5 + 4)
/// ppl::check::mean(&posterior, "rate", 20.0 / 4.5).within_mcse(4.0);
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// # References
/// Metropolis et al., J. Chem. Phys. 21 (1953) 1087, doi:10.1063/1.1699114; Haario, Saksman &
/// Tamminen, Computational Statistics 20 (2005) 265, doi:10.1007/BF02789703; Roberts & Rosenthal,
/// J. Comput. Graph. Stat. 18 (2009) 349, doi:10.1198/jcgs.2009.06134, section 3.
#[derive(Clone, Debug)]
pub struct ComponentwiseMetropolis<'a> {
    run: Run<'a>,
}

impl Default for ComponentwiseMetropolis<'_> {
    fn default() -> Self {
        Self { run: Run::new(1000, 5000) }
    }
}

impl<'a> ComponentwiseMetropolis<'a> {
    shared_settings!();

    /// Samples any log density; its gradient is not asked for.
    ///
    /// # Errors
    /// See [`ComponentwiseMetropolis`].
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Chains, SampleError> {
        self.run_any(density)
    }

    fn run_any(&self, density: &dyn AnyDensity) -> Result<Chains, SampleError> {
        let dim = density.dim();
        let chains = self.run.execute(dim, || Sweeps::new(density, Scales::new(dim)))?;
        Ok(Chains::new(dim, chains, self.run.thin))
    }

    /// As [`Nuts::resume`](super::Nuts::resume): goes on with chains of this sampler, finished or
    /// interrupted, to the very draws of one longer run.
    ///
    /// # Errors
    /// [`SampleError::Earlier`] if the chains are not of this sampler or this density, or one
    /// failed in its warmup; else see [`ComponentwiseMetropolis`].
    pub fn resume<D: LogDensity>(
        &self,
        density: &D,
        earlier: Chains,
    ) -> Result<Chains, SampleError> {
        self.resume_any(density, earlier)
    }

    fn resume_any(&self, density: &dyn AnyDensity, earlier: Chains) -> Result<Chains, SampleError> {
        self.run.resume(density.dim(), earlier, |chain| match chain.tuning.as_deref() {
            Some(Tuning::Sweeps(scales)) => Ok(Sweeps::new(density, scales.clone())),
            _ => Err(another_sampler()),
        })
    }

    /// Samples a model: the draws with everything the model names.
    ///
    /// # Errors
    /// See [`ComponentwiseMetropolis`]; also if the model cannot be evaluated, or a chain was
    /// stopped before its first draw.
    pub fn sample<M: Model>(&self, model: &Bound<M>) -> Result<Posterior, SampleError> {
        Posterior::sample(model, self.run.seed, &|density| self.run_any(density))
    }
}

/// The scale of every coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Scales {
    scales: Vec<f64>,
    /// Warmup sweeps.
    sweeps: usize,
}

impl Scales {
    fn new(dim: usize) -> Self {
        Self { scales: vec![1.0; dim], sweeps: 0 }
    }

    /// Learns from the acceptance probabilities of a sweep.
    fn learn(&mut self, acceptances: &[f64]) {
        self.sweeps += 1;
        let gain = (self.sweeps as f64).powf(-0.6);
        for (scale, acceptance) in self.scales.iter_mut().zip(acceptances) {
            *scale *= (gain * (acceptance - TARGET)).exp();
        }
    }

    /// Whether they are of a density of `dim` coordinates, after so many transitions.
    pub(super) fn fits(&self, dim: usize, transitions: usize) -> bool {
        self.scales.len() == dim && self.sweeps == transitions
    }
}

struct Sweeps<'a> {
    density: Box<dyn Evaluator + 'a>,
    y: Vec<f64>,
    log_density: f64,
    tuned: Scales,
    /// Acceptance probabilities of the last sweep.
    acceptances: Vec<f64>,
    rejections: Rejections,
}

impl<'a> Sweeps<'a> {
    fn new(density: &'a dyn AnyDensity, tuned: Scales) -> Self {
        let dim = density.dim();
        Self {
            density: density.evaluator(),
            y: vec![0.0; dim],
            log_density: f64::NEG_INFINITY,
            tuned,
            acceptances: vec![0.0; dim],
            rejections: Rejections::default(),
        }
    }
}

impl Kernel for Sweeps<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.y.copy_from_slice(y);
        self.log_density = finite(&mut *self.density, y)?;
        Ok(())
    }

    fn prepare(&mut self, _: &mut Stream) -> Result<(), Stop> {
        Ok(())
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, Stop> {
        let dim = self.y.len();
        for i in 0..dim {
            let old = self.y[i];
            self.y[i] = old + self.tuned.scales[i] * rng.sample::<f64, _>(StandardNormal);
            let proposed = self.rejections.value(&mut *self.density, &self.y)?;
            self.acceptances[i] = accepting(proposed - self.log_density);
            if rng.random::<f64>() < self.acceptances[i] {
                self.log_density = proposed;
            } else {
                self.y[i] = old;
            }
        }
        let mean = match dim {
            0 => 1.0,
            _ => self.acceptances.iter().sum::<f64>() / dim as f64,
        };
        Ok(DrawStats::walk(self.log_density, mean, 1.0, dim as u32))
    }

    fn adapt(&mut self, _: &DrawStats, _: &mut Stream) -> Result<(), Stop> {
        self.tuned.learn(&self.acceptances);
        Ok(())
    }

    fn freeze(&mut self, report: &mut WarmupReport) {
        report.step_size = 1.0;
        report.target_acceptance = TARGET;
        let variances = self.tuned.scales.iter().map(|s| s * s).collect();
        report.covariance = Covariance::Diagonal(variances);
    }

    fn tuning(&self) -> Tuning {
        Tuning::Sweeps(self.tuned.clone())
    }

    fn position(&self) -> &[f64] {
        &self.y
    }

    fn log_density(&self) -> f64 {
        self.log_density
    }

    fn divergence(&self) -> (&[f64], f64) {
        (&self.y, 0.0)
    }

    fn rejections(&mut self) -> &mut Rejections {
        &mut self.rejections
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.density.explain(y)
    }
}
