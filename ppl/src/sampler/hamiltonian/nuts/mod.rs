//! The no-U-turn sampler.

mod chain;

use crate::model::erased::ErasedDensity;
use crate::sampler::draws::chains::{Chain, Chains};
use crate::sampler::draws::report::WarmupReport;
use crate::sampler::hamiltonian::metric::Metric;
use crate::sampler::hamiltonian::trajectory::DEPTHS;
use crate::sampler::hamiltonian::warmup::{Adaptation, Warmup};
use crate::sampler::run::error::RunError;
use crate::sampler::run::mcmc::{Mcmc, Method, OneDensity};
use crate::sampler::run::resume::{another_sampler, misfit};
use crate::sampler::run::settings::Settings;
use crate::sampler::walk::tuning::Tuning;
use chain::NutsChain;

/// The no-U-turn sampler: Hamiltonian Monte Carlo that chooses the length of each trajectory automatically.
///
/// This is multinomial NUTS with the generalised criterion (Betancourt 2017). Defaults: target acceptance 0.8, at most
/// 10 doublings, starts uniform on (−2, 2), and 4 chains, each with 700 warmup transitions and 1000 draws.
///
/// Far from the posterior, energies can be so large that their differences are smaller than rounding errors, for
/// example where a rate is e⁸⁰. From such a start, a few steps of L-BFGS first move the chain towards the posterior;
/// the search stops well before the mode. The default warmup fits the inverse mass matrix M⁻¹ to draws y and scores
/// ∇ln p by minimising the Fisher divergence. In the first 30 % of the warmup, M⁻¹ is fitted after every 10 draws, to
/// the later half of all draws so far. After that, M⁻¹ is fitted at the end of windows with 80 · 1.5ⁿ draws. The last
/// 15 % of the warmup tune only the step size. Each fit chooses between
/// - a diagonal matrix, `√(var y / var ∇ln p)`, and
/// - a matrix with correlations: in up to 50 dimensions, the dense geometric mean of `cov y` and `(cov ∇ln p)⁻¹`; in
///   more dimensions, a diagonal with such a geometric mean in up to 32 directions.
///
/// Both matrices are fitted to the first two thirds of the draws, and the matrix with the smaller Fisher divergence
/// on the last third is chosen. After the first 30 % of the warmup, the current matrix is compared too. A divergent
/// transition in the last 15 % of the warmup raises the target acceptance to 0.9. If the later half of the warmup has
/// at least 3 divergent transitions and at least one per 75 transitions, the target acceptance is raised to 0.95.
/// [`Nuts::stan_compatible`] uses Stan's warmup. Stan's warmup needs more gradients on most posteriors, but it
/// chooses smaller steps on posteriors with unknown scales and many coordinates (horseshoe priors, spectral Gaussian
/// processes). After the warmup, step size and mass matrix are not adapted any more. [`WarmupReport`] lists all
/// decisions of the warmup and the transitions after which they were made.
///
/// A point that the density rejects ends its trajectory as a divergence; rejections are counted per location in the
/// model. A fatal error or the interrupt flag ends the run and keeps its draws. Call [`resume`](Mcmc::resume) with the
/// [`Chains`] of [`run`](Mcmc::run) to continue an interrupted run, even if it was interrupted in the warmup.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn level(measured: &[f64]) {
///         let level ~ Normal(0.0, 10.0);
///         for measured in measured {
///             measured ~ Normal(level, 0.5);
///         }
///     }
/// }
///
/// let sampler = Nuts::default().chains(2).warmup(300).draws(500).seed(7);
/// let posterior = sampler.sample(&level(&[3.1, 2.4, 2.9]))?;
/// // conjugate: precision 1/10² + 3/0.5²
/// ppl::check::mean(&posterior, "level", (8.4 / 0.25) / (0.01 + 12.0)).within_mcse(4.0);
/// # Ok::<(), ppl::SampleError>(())
/// ```
/// [`LogDensity`](crate::LogDensity) has an example of a density that is not a model.
///
/// # References
/// Hoffman & Gelman, JMLR 15 (2014) 1593; Betancourt, arXiv 1701.02434; Seyboldt, Carlson &
/// Carpenter 2026, arXiv 2603.18845.
pub type Nuts<'a> = Mcmc<'a, NoUTurn>;

/// Transition kernel of [`Nuts`].
#[derive(Clone, Debug)]
pub struct NoUTurn {
    adaptation: Adaptation,
    target_accept: f64,
    max_depth: u32,
}

impl Default for Nuts<'_> {
    fn default() -> Self {
        let method = NoUTurn { adaptation: Adaptation::Fisher, target_accept: 0.8, max_depth: 10 };
        Self { settings: Settings::new(700, 1000), method }
    }
}

impl Nuts<'_> {
    /// Creates a NUTS sampler with Stan's warmup of 1000 draws. The first 75 draws tune the step size, doubling
    /// windows then estimate the variances of the draws, and the last 50 draws tune the step size again. A warmup
    /// shorter than 150 draws is split into 15 / 75 / 10 %; a warmup shorter than 20 draws tunes the step size only.
    ///
    /// Reference: Stan Reference Manual, *HMC algorithm parameters*.
    pub fn stan_compatible() -> Self {
        let mut nuts = Self::default();
        (nuts.settings, nuts.method.adaptation) = (Settings::new(1000, 1000), Adaptation::Stan);
        nuts
    }

    /// Sets the target of the mean acceptance probability, between 0 and 1. The warmup tunes the step size so that
    /// the mean acceptance probability reaches this target.
    pub fn target_accept(mut self, target: f64) -> Self {
        self.method.target_accept = target;
        self
    }

    /// Sets the largest number of doublings of a trajectory, from 1 to 20. A draw needs at most `2^max_depth − 1`
    /// leapfrog steps.
    pub fn max_depth(mut self, depth: u32) -> Self {
        self.method.max_depth = depth;
        self
    }
}

impl NoUTurn {
    /// Returns an error if a setting is out of range.
    fn check(&self) -> Result<(), RunError> {
        let refuse = |setting, value, help| Err(RunError::Setting { setting, value, help });
        if !(self.target_accept > 0.0 && self.target_accept < 1.0) {
            let value = self.target_accept.to_string();
            return refuse(
                "target_accept",
                value,
                "give a number between 0 and 1, for example 0.8",
            );
        }
        if !DEPTHS.contains(&self.max_depth) {
            return refuse("max_depth", self.max_depth.to_string(), "give 1 to 20, for example 10");
        }
        Ok(())
    }
}

impl OneDensity for NoUTurn {}

impl Method for NoUTurn {
    type Target<'d> = &'d dyn ErasedDensity;

    fn run(
        &self,
        settings: &Settings<'_>,
        density: &dyn ErasedDensity,
    ) -> Result<Chains, RunError> {
        self.check()?;
        let dim = density.dim();
        let chains = settings.execute(density, || {
            let warmup = Warmup::new(self.adaptation, dim, settings.warmup, self.target_accept);
            NutsChain::new(density, self.max_depth, warmup, None)
        })?;
        Ok(Chains { max_depth: Some(self.max_depth), ..chains })
    }

    fn resume(
        &self,
        settings: &Settings<'_>,
        density: &dyn ErasedDensity,
        earlier: Chains,
    ) -> Result<Chains, RunError> {
        let max_depth = earlier.max_depth.ok_or_else(another_sampler)?;
        settings.resume(density.dim(), earlier, |chain| as_tuned(density, max_depth, chain))
    }
}

/// Rebuilds the transition kernel of a stored chain in its state after the last transition.
fn as_tuned<'a>(
    density: &'a dyn ErasedDensity,
    max_depth: u32,
    chain: &Chain,
) -> Result<NutsChain<'a>, RunError> {
    let dim = density.dim();
    let (covariance, step, warmup) = match chain.tuning.as_deref() {
        Some(Tuning::Hamiltonian { covariance, step, warmup }) => {
            (covariance, *step, warmup.clone())
        }
        Some(_) => return Err(another_sampler()),
        None => {
            let WarmupReport { covariance, step_size, .. } = &chain.warmup;
            (covariance, *step_size, Warmup::new(Adaptation::Fisher, dim, 0, 0.8))
        }
    };
    let metric = Metric::from_covariance(covariance, dim)
        .filter(|_| step.is_finite() && step > 0.0)
        .ok_or_else(|| {
            let reason = "a mass matrix is not positive definite, or a step size is not positive";
            misfit(reason, "start a new run with `run`")
        })?;
    Ok(NutsChain::new(density, max_depth, warmup, Some((metric, step))))
}
