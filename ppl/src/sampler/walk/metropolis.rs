//! Adaptive random-walk Metropolis.

use rand::Rng;

use crate::density::Rejection;
use crate::model::erased::{ErasedDensity, Evaluator};
use crate::sampler::draws::chains::Chains;
use crate::sampler::draws::report::{DrawStats, WarmupReport};
use crate::sampler::run::chains::MarkovChain;
use crate::sampler::run::error::RunError;
use crate::sampler::run::mcmc::{Mcmc, Method, OneDensity};
use crate::sampler::run::rejections::{Rejections, accepting, finite};
use crate::sampler::run::resume::another_sampler;
use crate::sampler::run::settings::Settings;
use crate::sampler::run::stop::StopReason;
use crate::sampler::run::stream::Stream;
use crate::sampler::walk::proposal::{Proposal, ProposalShape};
use crate::sampler::walk::tuning::Tuning;

/// Random-walk Metropolis that adapts its proposal `Normal(y, s² Σ)` in the warmup.
///
/// The sampler needs no gradient. The first Σ is diagonal. The diagonal entries are the squared scales of the prior,
/// computed from the quartiles of 200 prior draws, so that the units of the coordinates do not matter. For a density
/// without a prior, the first Σ is the identity. Windows of the warmup then update Σ: they lie between the first 10 %
/// and the last 25 % of the warmup, the first has 100 draws, and each following window has twice as many. After each
/// window, Σ is the covariance of the draws in the window, with correlations shrunk by n/(n+5), so that Σ is positive
/// definite for any number n of draws. The scale s restarts at 2.38/√d in every window. The Robbins-Monro update
/// `ln s ← ln s + k^−0.6 (a − a*)` tunes the acceptance probability a to `a* = 0.234 + 0.206/d`. After the warmup, Σ
/// and s are not adapted any more, so that the kept draws are an ordinary Markov chain. The cost of an effective draw
/// grows with the dimension d; prefer [`Nuts`](crate::Nuts) if gradients are available.
///
/// Statistics of a draw: `leapfrogs` is 1, `depth` is 0, `step_size` is s, `energy` is −ln p.
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
pub type Metropolis<'a> = Mcmc<'a, RandomWalk>;

/// Transition kernel of [`Metropolis`].
#[derive(Clone, Copy, Debug)]
pub struct RandomWalk;

impl Default for Metropolis<'_> {
    fn default() -> Self {
        Self { settings: Settings::new(5000, 10_000), method: RandomWalk }
    }
}

impl OneDensity for RandomWalk {}

impl Method for RandomWalk {
    type Target<'d> = &'d dyn ErasedDensity;

    fn run(
        &self,
        settings: &Settings<'_>,
        density: &dyn ErasedDensity,
    ) -> Result<Chains, RunError> {
        let shape = ProposalShape::new(density, settings);
        settings.execute(density, || MetropolisChain::new(density, shape.clone()))
    }

    fn resume(
        &self,
        settings: &Settings<'_>,
        density: &dyn ErasedDensity,
        earlier: Chains,
    ) -> Result<Chains, RunError> {
        settings.resume(density.dim(), earlier, |chain| match chain.tuning.as_deref() {
            Some(Tuning::Walk(shape)) => Ok(MetropolisChain::new(density, shape.clone())),
            _ => Err(another_sampler()),
        })
    }
}

struct MetropolisChain<'a> {
    density: Box<dyn Evaluator + 'a>,
    y: Vec<f64>,
    log_density: f64,
    proposal: Vec<f64>,
    walk: Proposal,
    rejections: Rejections,
}

impl<'a> MetropolisChain<'a> {
    fn new(density: &'a dyn ErasedDensity, shape: ProposalShape) -> Self {
        let dim = density.dim();
        Self {
            density: density.evaluator(),
            y: vec![0.0; dim],
            log_density: f64::NEG_INFINITY,
            proposal: vec![0.0; dim],
            walk: Proposal::new(shape),
            rejections: Rejections::default(),
        }
    }
}

impl MarkovChain for MetropolisChain<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.y.copy_from_slice(y);
        self.log_density = finite(&mut *self.density, y)?;
        Ok(())
    }

    fn prepare(&mut self, _: &mut Stream) -> Result<(), StopReason> {
        Ok(())
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, StopReason> {
        self.walk.propose(&self.y, &mut self.proposal, rng);
        let proposed = self.rejections.value(&mut *self.density, &self.proposal)?;
        let acceptance = accepting(proposed - self.log_density);
        if rng.random::<f64>() < acceptance {
            std::mem::swap(&mut self.y, &mut self.proposal);
            self.log_density = proposed;
        }
        Ok(DrawStats::walk(self.log_density, acceptance, self.walk.shape.scale, 1))
    }

    fn adapt(&mut self, stats: &DrawStats, _: &mut Stream) -> Result<(), StopReason> {
        self.walk.shape.learn(stats.acceptance, &self.y);
        Ok(())
    }

    fn freeze(&mut self, report: &mut WarmupReport) {
        self.walk.shape.report(report);
    }

    fn tuning(&self) -> Tuning {
        Tuning::Walk(self.walk.shape.clone())
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
