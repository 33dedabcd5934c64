//! User-defined transition kernels.

use rand::RngCore;

use crate::density::{FatalError, Location, Rejection};
use crate::model::erased::{ErasedDensity, Evaluator};
use crate::sampler::draws::chains::Chains;
use crate::sampler::draws::report::{DrawStats, WarmupReport};
use crate::sampler::run::chains::MarkovChain;
use crate::sampler::run::error::RunError;
use crate::sampler::run::mcmc::{Mcmc, Method, OneDensity};
use crate::sampler::run::rejections::{Rejections, finite};
use crate::sampler::run::resume::misfit;
use crate::sampler::run::settings::Settings;
use crate::sampler::run::stop::StopReason;
use crate::sampler::run::stream::Stream;
use crate::sampler::walk::tuning::Tuning;

/// Transition kernel of a user-defined sampler: it moves a chain and leaves the target density invariant.
///
/// [`Mcmc::with_kernel`] creates a sampler from a kernel, with all settings of [`Mcmc`]: chains, warmup, draws,
/// thinning, seed, threads, starting points, progress and interrupts. Only [`resume`](Mcmc::resume) is not available,
/// because the state of the kernel is not stored.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::rand::{Rng, RngCore};
/// use ppl::{ChainState, Kernel, Mcmc, Step, StopReason};
///
/// /// Langevin proposals with a fixed step size and a Metropolis correction.
/// struct Langevin(f64);
///
/// impl Kernel for Langevin {
///     fn transition(
///         &mut self,
///         state: &mut ChainState<'_>,
///         mut rng: &mut dyn RngCore,
///     ) -> Result<Step, StopReason> {
///         let (size, here, dim) = (self.0, state.position().to_vec(), state.dim());
///         let (mut slope, mut back) = (vec![0.0; dim], vec![0.0; dim]);
///         let before = state.gradient(&here, &mut slope)?;
///         let noise = Normal(0.0, 1.0);
///         let drift = |y: f64, g: f64| y + 0.5 * size * size * g;
///         let there: Vec<f64> = here.iter().zip(&slope)
///             .map(|(y, g)| drift(*y, *g) + size * noise.sample(&mut rng))
///             .collect();
///         let after = state.gradient(&there, &mut back)?;
///         // log density of a move from `a` to `b`, without constants
///         let ln_move = |a: &[f64], g: &[f64], b: &[f64]| -> f64 {
///             let distances = a.iter().zip(g).zip(b).map(|((a, g), b)| (b - drift(*a, *g)) / size);
///             -0.5 * distances.map(|z| z * z).sum::<f64>()
///         };
///         let forward = ln_move(&here, &slope, &there);
///         let acceptance = (after - before + ln_move(&there, &back, &here) - forward).exp().min(1.0);
///         if rng.random::<f64>() < acceptance {
///             state.move_to(&there, after)?;
///         }
///         Ok(Step { acceptance, scale: size })
///     }
/// }
///
/// ppl::model! {
///     fn height(y: &[f64]) {
///         let mean ~ Normal(0.0, 10.0);
///         for y in y {
///             y ~ Normal(mean, 1.0);
///         }
///     }
/// }
/// let sampler = Mcmc::with_kernel(|_| Langevin(0.8)).chains(2).warmup(200).draws(2000).seed(3);
/// let posterior = sampler.sample(&height(&[1.8, 2.1, 2.4]))?;
/// // precision 3 + 1/100
/// ppl::check::mean(&posterior, "mean", 6.3 / 3.01).within_mcse(4.0);
/// # Ok::<(), ppl::SampleError>(())
/// ```
pub trait Kernel {
    /// Runs one transition: evaluates the density by `state`, and calls [`ChainState::move_to`] if the chain moves.
    ///
    /// # Errors
    /// A fatal error, as returned by the methods of `state`.
    fn transition(
        &mut self,
        state: &mut ChainState<'_>,
        rng: &mut dyn RngCore,
    ) -> Result<Step, StopReason>;

    /// Adapts the kernel after a transition of the warmup. By default, the kernel is not adapted.
    ///
    /// # Errors
    /// A fatal error, as returned by the methods of `state`.
    fn adapt(
        &mut self,
        state: &mut ChainState<'_>,
        step: &Step,
        rng: &mut dyn RngCore,
    ) -> Result<(), StopReason> {
        let _ = (state, step, rng);
        Ok(())
    }
}

/// Statistics of one transition of a [`Kernel`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Acceptance probability.
    pub acceptance: f64,
    /// Scale of the proposal.
    pub scale: f64,
}

/// Position of a chain, and the density that it samples. All points are in unconstrained space.
#[allow(missing_debug_implementations, reason = "the density is type-erased")]
pub struct ChainState<'a> {
    density: Box<dyn Evaluator + 'a>,
    position: Vec<f64>,
    log_density: f64,
    evaluations: u32,
    rejections: Rejections,
}

impl ChainState<'_> {
    /// Number of coordinates.
    pub fn dim(&self) -> usize {
        self.position.len()
    }

    /// Current position of the chain.
    pub fn position(&self) -> &[f64] {
        &self.position
    }

    /// Log density at the current position.
    pub fn log_density(&self) -> f64 {
        self.log_density
    }

    /// Log density at `y`; −∞ if the density rejects the point. The rejection is counted for the report.
    ///
    /// # Errors
    /// A fatal error of the density, or [`FatalError::PointLength`] if `y` has the wrong length. Both end the chain.
    pub fn evaluate(&mut self, y: &[f64]) -> Result<f64, StopReason> {
        self.check_length(y)?;
        self.evaluations += 1;
        self.rejections.value(&mut *self.density, y)
    }

    /// Log density at `y`; the gradient is written to `gradient`. Returns −∞ and a gradient of zeros if the density
    /// rejects the point, or if the log density or its gradient is not finite. The rejection is counted for the report.
    ///
    /// # Errors
    /// A fatal error of the density, [`FatalError::PointLength`] if `y` has the wrong length, or
    /// [`FatalError::GradientLength`] if `gradient` and `y` have different lengths. These errors end the chain.
    pub fn gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> Result<f64, StopReason> {
        self.check_length(y)?;
        if gradient.len() != y.len() {
            let error = FatalError::GradientLength { gradient: gradient.len(), point: y.len() };
            return Err(StopReason::Fatal(Box::new(error)));
        }
        self.evaluations += 1;
        let rejection = match self.density.gradient(y, gradient) {
            Ok(value) => {
                let value_and_gradient = std::iter::once(&value).chain(&*gradient);
                match value_and_gradient.copied().find(|number| !number.is_finite()) {
                    None => return Ok(value),
                    Some(value) => Rejection::NotFinite { location: Location::unknown(), value },
                }
            }
            Err(rejection) => rejection,
        };
        gradient.fill(0.0);
        self.rejections.count(&rejection)?;
        Ok(f64::NEG_INFINITY)
    }

    /// Moves the chain to `y`, where the log density has the given value.
    ///
    /// # Errors
    /// [`FatalError::PointLength`] if `y` has the wrong length. The error ends the chain.
    pub fn move_to(&mut self, y: &[f64], log_density: f64) -> Result<(), StopReason> {
        self.check_length(y)?;
        self.position.copy_from_slice(y);
        self.log_density = log_density;
        Ok(())
    }

    /// Returns an error if the length of `y` differs from the number of coordinates.
    fn check_length(&self, y: &[f64]) -> Result<(), StopReason> {
        let (point, dim) = (y.len(), self.dim());
        match point == dim {
            true => Ok(()),
            false => Err(StopReason::Fatal(Box::new(FatalError::PointLength { point, dim }))),
        }
    }
}

/// Method of a sampler with a user-defined [`Kernel`]. The field is the function that creates the kernel of a chain
/// from the number of coordinates.
#[derive(Clone, Copy, Debug)]
pub struct UserKernel<F>(F);

impl<F, K> Mcmc<'_, UserKernel<F>>
where
    F: Fn(usize) -> K + Sync,
    K: Kernel,
{
    /// Creates a sampler with a user-defined kernel. `make` creates the kernel of each chain from the number of
    /// coordinates. Defaults: 4 chains, each with 1000 warmup transitions and 1000 draws.
    pub fn with_kernel(make: F) -> Self {
        Self { settings: Settings::new(1000, 1000), method: UserKernel(make) }
    }
}

impl<F: Fn(usize) -> K + Sync, K: Kernel> OneDensity for UserKernel<F> {}

impl<F: Fn(usize) -> K + Sync, K: Kernel> Method for UserKernel<F> {
    type Target<'d> = &'d dyn ErasedDensity;

    fn run(
        &self,
        settings: &Settings<'_>,
        density: &dyn ErasedDensity,
    ) -> Result<Chains, RunError> {
        settings.execute(density, || KernelChain {
            kernel: (self.0)(density.dim()),
            state: ChainState {
                density: density.evaluator(),
                position: vec![0.0; density.dim()],
                log_density: f64::NEG_INFINITY,
                evaluations: 0,
                rejections: Rejections::default(),
            },
        })
    }

    fn resume(
        &self,
        _: &Settings<'_>,
        _: &dyn ErasedDensity,
        _: Chains,
    ) -> Result<Chains, RunError> {
        Err(misfit(
            "the state of a user-defined kernel is not stored",
            "start a new run with `run`",
        ))
    }
}

struct KernelChain<'a, K> {
    kernel: K,
    state: ChainState<'a>,
}

impl<K: Kernel> MarkovChain for KernelChain<'_, K> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        let log_density = finite(&mut *self.state.density, y)?;
        self.state.position.copy_from_slice(y);
        self.state.log_density = log_density;
        Ok(())
    }

    fn prepare(&mut self, _: &mut Stream) -> Result<(), StopReason> {
        Ok(())
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, StopReason> {
        self.state.evaluations = 0;
        let Step { acceptance, scale } = self.kernel.transition(&mut self.state, rng)?;
        let ChainState { log_density, evaluations, .. } = self.state;
        Ok(DrawStats::walk(log_density, acceptance, scale, evaluations))
    }

    fn adapt(&mut self, stats: &DrawStats, rng: &mut Stream) -> Result<(), StopReason> {
        let step = Step { acceptance: stats.acceptance, scale: stats.step_size };
        self.kernel.adapt(&mut self.state, &step, rng)
    }

    fn freeze(&mut self, _: &mut WarmupReport) {}

    fn tuning(&self) -> Tuning {
        Tuning::UserDefined
    }

    fn position(&self) -> &[f64] {
        &self.state.position
    }

    fn log_density(&self) -> f64 {
        self.state.log_density
    }

    fn divergence(&self) -> (&[f64], f64) {
        (&self.state.position, 0.0)
    }

    fn rejections(&mut self) -> &mut Rejections {
        &mut self.state.rejections
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.state.density.explain(y)
    }
}
