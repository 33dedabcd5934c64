//! Delayed-acceptance Metropolis.

use crate::density::LogDensity;
use crate::model::erased::ErasedDensity;
use crate::sampler::draws::chains::Chains;
use crate::sampler::run::error::RunError;
use crate::sampler::run::mcmc::{Mcmc, Method};
use crate::sampler::run::resume::{another_sampler, misfit};
use crate::sampler::run::settings::Settings;
use crate::sampler::walk::delayed_kernel::Delayed;
use crate::sampler::walk::proposal::ProposalShape;
use crate::sampler::walk::screening::Screening;
use crate::sampler::walk::tuning::Tuning;

/// Metropolis sampler in which a cheap density screens the proposals and an expensive density accepts or rejects them.
///
/// From the current point y, n = `screening_steps` random-walk Metropolis steps on the cheap density q lead to a point
/// y′. If y′ differs from y, the expensive density p is evaluated at y′, and y′ is accepted with probability `min(1,
/// p(y′) q(y) / (p(y) q(y′)))`. The draws follow **p for every q** that is positive wherever p is positive; a poor q
/// lowers the acceptance rate but does not bias the draws. With n = 1 this is delayed acceptance, with n > 1 the
/// surrogate-transition method: a larger n makes the draws less correlated if q is close to p, and lowers the
/// acceptance rate if q is poor. With probability [`plain_share`](Self::plain_share), independent of the point, a
/// transition is instead one random-walk Metropolis step on p. The proposal is the proposal of
/// [`Metropolis`](crate::Metropolis). The warmup tunes it to the acceptance rate under q; after the warmup nothing is
/// adapted. Since the tuning depends on q only, most of the warmup can run without p: see
/// [`screened_warmup`](Self::screened_warmup).
///
/// Statistics of a draw: `leapfrogs` is the number of evaluations of the *expensive* density in a transition: 0 or 1,
/// and one more in the first transition after a screened warmup. [`Chains::evaluations`] is the sum of these numbers.
/// `acceptance` is the acceptance probability under p; it is 0 if the screening did not move the chain. `step_size`,
/// `depth` and `energy` are defined as for Metropolis on the density p.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// Stiffness from forces. `factor` is the systematic error of the cheap model; 1 is no error.
///     fn spring(factor: f64, force_n: &[f64]) {
///         let stiffness ~ Uniform(0.0, 10.0); // N/mm
///         for force in force_n {
///             force ~ Normal(factor * stiffness, 0.5);
///         }
///     }
/// }
///
/// let force_n = [4.1, 5.2, 4.6];
/// let (cheap, expensive) = (spring(0.95, &force_n), spring(1.0, &force_n));
/// let sampler = DelayedAcceptance::default().screening_steps(4).seed(7);
/// let posterior = sampler.sample(&cheap, &expensive)?;
/// ppl::check::mean(&posterior, "stiffness", 13.9 / 3.0).within_mcse(4.0);
/// println!("{} expensive evaluations", posterior.chains.evaluations());
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// # References
/// Christen & Fox, J. Comput. Graph. Stat. 14 (2005) 795, doi:10.1198/106186005X76983; Liu, *Monte
/// Carlo Strategies in Scientific Computing* (2001), doi:10.1007/978-0-387-76371-2, section 9.4.3.
pub type DelayedAcceptance<'a> = Mcmc<'a, Screened>;

/// Transition kernel of [`DelayedAcceptance`].
#[derive(Clone, Copy, Debug)]
pub struct Screened {
    screening: Screening,
    /// Number of warmup transitions that use the cheap density only.
    alone: usize,
}

impl Default for DelayedAcceptance<'_> {
    fn default() -> Self {
        let screening = Screening { steps: 1, power: 1.0, plain_share: 0.0 };
        Self { settings: Settings::new(2000, 5000), method: Screened { screening, alone: 0 } }
    }
}

impl DelayedAcceptance<'_> {
    /// Sets the number of steps on the cheap density per evaluation of the expensive density, at least 1. The default
    /// is 1.
    pub fn screening_steps(mut self, steps: u32) -> Self {
        self.method.screening.steps = steps;
        self
    }

    /// Sets the exponent of the cheap density, in (0, 1]. The default is 1.
    ///
    /// Where the cheap density decreases faster than the expensive density, a chain can stay at one point for many
    /// transitions, because the correction factor rejects almost every move away from it. R-hat is then large even if
    /// the cheap density is accurate elsewhere. An exponent below 1 widens the cheap density; in exchange, more
    /// proposals are rejected. For a posterior with ten unknowns and a good surrogate, try 0.8 first. The draws follow
    /// the expensive density for every exponent.
    pub fn screening_power(mut self, power: f64) -> Self {
        self.method.screening.power = power;
        self
    }

    /// Sets the probability that a transition is one random-walk Metropolis step on the expensive density without
    /// screening, from 0 to below 1. The default is 0.
    ///
    /// Where the cheap density is far too small, the screening moves away from a point, and the correction factor
    /// rejects the points that the screening reaches, so that the chain does not move. Steps that ignore the cheap
    /// density move the chain away from such a point. The choice between the two kinds of transition does not depend on
    /// the point, so that the draws follow the expensive density for every share. Such a step costs one expensive
    /// evaluation, as a screened transition does.
    pub fn plain_share(mut self, share: f64) -> Self {
        self.method.screening.plain_share = share;
        self
    }

    /// Sets the number of warmup transitions, at the beginning of the warmup, that use the cheap density only; at
    /// most the length of the warmup. The default is 0.
    ///
    /// These transitions tune the proposal and move the chain to the typical set of the cheap density. The rest of
    /// the warmup, which needs some tens of transitions, moves the chain to the typical set of the expensive density.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    /// use ppl::Rejection;
    ///
    /// /// A normal density with the given mean and unit variance.
    /// struct About(f64);
    /// impl LogDensity for About {
    ///     type Workspace = ();
    ///     fn dim(&self) -> usize { 1 }
    ///     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
    ///         Ok(-0.5 * (y[0] - self.0).powi(2))
    ///     }
    ///     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
    ///         g[0] = self.0 - y[0];
    ///         self.log_density(y, w)
    ///     }
    /// }
    /// let sampler = DelayedAcceptance::default().warmup(1020).screened_warmup(1000).draws(100);
    /// let chains = sampler.screening_steps(10).run(&About(0.3), &About(0.0))?;
    /// // per chain: one evaluation at the start, 20 transitions and 100 draws
    /// assert!(chains.evaluations() <= 4 * 121);
    /// # Ok::<(), ppl::RunError>(())
    /// ```
    pub fn screened_warmup(mut self, transitions: usize) -> Self {
        self.method.alone = transitions;
        self
    }

    /// Samples the density `expensive` with screening by the density `cheap`.
    ///
    /// The two densities must have the same coordinates. Their gradients are not used, and the normalising constant of
    /// `cheap` is arbitrary.
    ///
    /// # Errors
    /// [`RunError`] if a setting is out of range, if the two densities have different unknowns, or if a chain finds no
    /// starting point that both densities accept.
    pub fn run<C: LogDensity, D: LogDensity>(
        &self,
        cheap: &C,
        expensive: &D,
    ) -> Result<Chains, RunError> {
        self.method.run(&self.settings, [cheap, expensive])
    }

    /// Continues chains of this sampler, finished or interrupted, as [`Nuts::resume`](Mcmc::resume) does. The draws are
    /// identical to the draws of one longer run.
    ///
    /// # Errors
    /// [`RunError::Resume`] if the chains come from another sampler, from other densities or from another number of
    /// screening steps, or if a chain failed in its warmup.
    pub fn resume<C: LogDensity, D: LogDensity>(
        &self,
        cheap: &C,
        expensive: &D,
        earlier: Chains,
    ) -> Result<Chains, RunError> {
        self.method.resume(&self.settings, [cheap, expensive], earlier)
    }
}

impl Method for Screened {
    /// The pair of the cheap density and the expensive density.
    type Target<'d> = [&'d dyn ErasedDensity; 2];

    fn run(
        &self,
        settings: &Settings<'_>,
        [cheap, expensive]: [&dyn ErasedDensity; 2],
    ) -> Result<Chains, RunError> {
        self.screening.check()?;
        common_dim(cheap, expensive)?;
        let alone = self.alone.min(settings.warmup);
        // use the cheap density, whose prior draws cost less
        let shape = ProposalShape::new(cheap, settings);
        let kernel = || {
            Delayed::new(cheap, expensive, shape.clone(), self.screening)
                .screened_warmup(alone, alone > 0)
        };
        settings.execute(expensive, kernel)
    }

    fn resume(
        &self,
        settings: &Settings<'_>,
        [cheap, expensive]: [&dyn ErasedDensity; 2],
        earlier: Chains,
    ) -> Result<Chains, RunError> {
        let dim = common_dim(cheap, expensive)?;
        settings.resume(dim, earlier, |chain| match chain.tuning.as_deref() {
            Some(Tuning::Screened(shape, screening)) if *screening == self.screening => {
                let passed = chain.warmup.stats.len();
                let length = chain.paused.as_ref().map_or(0, |paused| paused.length);
                let left = length.saturating_sub(passed);
                let alone = self.alone.saturating_sub(passed).min(left);
                // the first transition with the expensive density also evaluates this density at the current point
                let is_unevaluated = self.alone > 0 && passed <= self.alone && chain.is_empty();
                Ok(Delayed::new(cheap, expensive, shape.clone(), *screening)
                    .screened_warmup(alone, is_unevaluated))
            }
            Some(Tuning::Screened(_, Screening { steps, power, plain_share })) => {
                let reason = format!(
                    "they took {steps} screening steps on a density to the power {power}, and a share {plain_share} of \
                     steps without screening"
                );
                let help =
                    "set `screening_steps`, `screening_power` and `plain_share` to the values of the earlier run";
                Err(misfit(reason, help))
            }
            _ => Err(another_sampler()),
        })
    }
}

/// Returns the common number of coordinates of the two densities, or an error if the numbers differ.
fn common_dim(cheap: &dyn ErasedDensity, expensive: &dyn ErasedDensity) -> Result<usize, RunError> {
    let (screening, deciding) = (cheap.dim(), expensive.dim());
    if screening == deciding {
        return Ok(deciding);
    }
    let unknowns = |dim: usize| format!("{dim} unconstrained coordinates");
    Err(RunError::Screening { screening: unknowns(screening), deciding: unknowns(deciding) })
}
