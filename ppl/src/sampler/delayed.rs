//! Delayed-acceptance Metropolis.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::{
    chains::Chains,
    error::RunError,
    mcmc::{Mcmc, Method},
    proposal::{Proposal, ProposalShape},
    rejections::{Rejections, accepting, finite},
    report::{DrawStats, WarmupReport},
    resume::{another_sampler, misfit},
    run::MarkovChain,
    settings::Settings,
    stop::StopReason,
    stream::Stream,
    tuning::Tuning,
};
use crate::{
    density::{LogDensity, Rejection},
    erased::{ErasedDensity, Evaluator},
};

/// Metropolis where a cheap density screens proposals and an expensive one decides.
///
/// From y, `screening_steps` n random-walk Metropolis steps on the cheap density q lead to y′;
/// only if they moved, the expensive density p is evaluated at y′, which is accepted with
/// probability `min(1, p(y′) q(y) / (p(y) q(y′)))`. The draws are those of **p, whatever q is**,
/// as long as q is not zero where p is not; a poor q costs acceptance, not truth. With n = 1 this is
/// delayed acceptance, with more the surrogate-transition method: draws are less correlated and a
/// good q is used up, a poor one is rejected more often. The proposal is that of
/// [`Metropolis`](super::Metropolis), tuned in the warmup to the acceptance under q; afterwards
/// nothing is adapted. Since it is tuned by q alone, most of a warmup need not ask p:
/// [`screened_warmup`](Self::screened_warmup).
///
/// Statistics of a draw: `leapfrogs` counts the evaluations of the *expensive* density (0 or 1 a
/// transition, one more in the first after a screened warmup; [`Chains::evaluations`] adds them up), `acceptance` is its acceptance probability, 0
/// where the screening did not move; `step_size`, `depth`, `energy` as for Metropolis, with p.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// Stiffness from forces; `factor` stands for what the cheap model gets wrong.
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

/// How [`DelayedAcceptance`] moves.
#[derive(Clone, Copy, Debug)]
pub struct Screened {
    screening: Screening,
    /// Transitions of the warmup on the cheap density alone.
    alone: usize,
}

/// What a transition does on the cheap density.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Screening {
    steps: u32,
    /// The cheap density is raised to it.
    power: f64,
}

impl Screening {
    fn check(self) -> Result<(), RunError> {
        let refused = |setting, value, help| Err(RunError::Setting { setting, value, help });
        if self.steps == 0 {
            return refused("screening_steps", "0".into(), "give at least 1");
        }
        if !(self.power > 0.0 && self.power <= 1.0) {
            let help = "give a number above 0, at most 1";
            return refused("screening_power", self.power.to_string(), help);
        }
        Ok(())
    }
}

impl Default for DelayedAcceptance<'_> {
    fn default() -> Self {
        let screening = Screening { steps: 1, power: 1.0 };
        Self { settings: Settings::new(2000, 5000), method: Screened { screening, alone: 0 } }
    }
}

impl DelayedAcceptance<'_> {
    /// Steps on the cheap density for each decision of the expensive one, at least 1.
    pub fn screening_steps(mut self, steps: u32) -> Self {
        self.method.screening.steps = steps;
        self
    }

    /// Raises the cheap density to this power, above 0 and at most 1; 1 unless set.
    ///
    /// Where the cheap density falls off faster than the expensive one, a chain that gets there stays for many
    /// transitions: every way back looks worse than it is. R-hat is then large however good the cheap
    /// density is elsewhere. A power below 1 makes the cheap density wide enough; more proposals are rejected
    /// for it. For a posterior of ten unknowns with a good surrogate 0.8 is a start. The draws are those of
    /// the expensive density whatever the power.
    pub fn screening_power(mut self, power: f64) -> Self {
        self.method.screening.power = power;
        self
    }

    /// Makes the first `transitions` of the warmup on the cheap density alone, without asking the expensive
    /// one: they tune the proposal and go where q says. The rest of the warmup, some tens of transitions,
    /// leads from there to p. At most the warmup; 0 unless set.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    /// use ppl::Rejection;
    ///
    /// /// A normal density about a place.
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
    /// // for each chain its start, 20 transitions and 100 draws
    /// assert!(chains.evaluations() <= 4 * 121);
    /// # Ok::<(), ppl::RunError>(())
    /// ```
    pub fn screened_warmup(mut self, transitions: usize) -> Self {
        self.method.alone = transitions;
        self
    }

    /// Samples `expensive`, screened by `cheap`: any log densities of the same coordinates. Their
    /// gradients are not asked for, and `cheap` need not be normalised alike.
    ///
    /// # Errors
    /// [`RunError`] if a setting is out of range, the two densities do not have the same unknowns,
    /// or a chain finds no starting point that both accept.
    pub fn run<C: LogDensity, D: LogDensity>(
        &self,
        cheap: &C,
        expensive: &D,
    ) -> Result<Chains, RunError> {
        self.method.run(&self.settings, [cheap, expensive])
    }

    /// As [`Nuts::resume`](Mcmc::resume): goes on with chains of this sampler, finished or
    /// interrupted, to the very draws of one longer run.
    ///
    /// # Errors
    /// [`RunError::Resume`] if the chains are not of this sampler, these densities and as many
    /// screening steps, or one failed in its warmup.
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
    /// The cheap one, and the expensive one.
    type Target<'d> = [&'d dyn ErasedDensity; 2];

    fn run(
        &self,
        settings: &Settings<'_>,
        [cheap, expensive]: [&dyn ErasedDensity; 2],
    ) -> Result<Chains, RunError> {
        self.screening.check()?;
        common_dim(cheap, expensive)?;
        let alone = self.alone.min(settings.warmup);
        // the prior of the cheap density costs less to draw from
        let shape = ProposalShape::new(cheap, settings);
        let kernel = || Delayed {
            alone,
            is_unasked: alone > 0,
            ..Delayed::new(cheap, expensive, shape.clone(), self.screening)
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
                Ok(Delayed {
                    alone: self.alone.saturating_sub(passed).min(left),
                    // the expensive density is asked in the first transition that it decides
                    is_unasked: self.alone > 0 && passed <= self.alone && chain.is_empty(),
                    ..Delayed::new(cheap, expensive, shape.clone(), *screening)
                })
            }
            Some(Tuning::Screened(_, Screening { steps, power })) => {
                let reason =
                    format!("they took {steps} screening steps on a density to the power {power}");
                Err(misfit(reason, "set `screening_steps` and `screening_power` as they were"))
            }
            _ => Err(another_sampler()),
        })
    }
}

/// The number of coordinates of both.
fn common_dim(cheap: &dyn ErasedDensity, expensive: &dyn ErasedDensity) -> Result<usize, RunError> {
    let (screening, deciding) = (cheap.dim(), expensive.dim());
    if screening == deciding {
        return Ok(deciding);
    }
    let unknowns = |dim: usize| format!("{dim} unconstrained coordinates");
    Err(RunError::Screening { screening: unknowns(screening), deciding: unknowns(deciding) })
}

/// A density to a power, with its current point.
struct Evaluated<'a> {
    density: Box<dyn Evaluator + 'a>,
    power: f64,
    y: Vec<f64>,
    log_density: f64,
}

impl<'a> Evaluated<'a> {
    fn new(density: &'a dyn ErasedDensity, power: f64, dim: usize) -> Self {
        let density = density.evaluator();
        Self { density, power, y: vec![0.0; dim], log_density: f64::NEG_INFINITY }
    }

    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.y.copy_from_slice(y);
        self.log_density = self.power * finite(&mut *self.density, y)?;
        Ok(())
    }

    /// The log density at another point, −∞ where it is rejected, which is counted.
    fn value(&mut self, y: &[f64], rejections: &mut Rejections) -> Result<f64, StopReason> {
        Ok(self.power * rejections.value(&mut *self.density, y)?)
    }
}

struct Delayed<'a> {
    cheap: Evaluated<'a>,
    expensive: Evaluated<'a>,
    next: Vec<f64>,
    walk: Proposal,
    screening: Screening,
    /// Transitions ahead on the cheap density alone.
    alone: usize,
    /// Whether the expensive density has not been asked at the current point.
    is_unasked: bool,
    /// Mean acceptance probability of the last screening.
    screened: f64,
    rejections: Rejections,
}

impl<'a> Delayed<'a> {
    fn new(
        cheap: &'a dyn ErasedDensity,
        expensive: &'a dyn ErasedDensity,
        shape: ProposalShape,
        screening: Screening,
    ) -> Self {
        let dim = expensive.dim();
        Self {
            cheap: Evaluated::new(cheap, screening.power, dim),
            expensive: Evaluated::new(expensive, 1.0, dim),
            next: vec![0.0; dim],
            walk: Proposal::new(shape),
            screening,
            alone: 0,
            is_unasked: false,
            screened: 0.0,
            rejections: Rejections::default(),
        }
    }

    /// The steps on the cheap density; whether they moved.
    fn screen(&mut self, rng: &mut Stream) -> Result<bool, StopReason> {
        let (mut moved, mut sum) = (false, 0.0);
        for _ in 0..self.screening.steps {
            let level = &mut self.cheap;
            self.walk.propose(&level.y, &mut self.next, rng);
            let value = level.value(&self.next, &mut self.rejections)?;
            let acceptance = accepting(value - level.log_density);
            sum += acceptance;
            if rng.random::<f64>() < acceptance {
                std::mem::swap(&mut level.y, &mut self.next);
                level.log_density = value;
                moved = true;
            }
        }
        self.screened = sum / f64::from(self.screening.steps);
        Ok(moved)
    }
}

impl MarkovChain for Delayed<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.cheap.begin(y)?;
        if self.is_unasked {
            self.expensive.y.copy_from_slice(y);
            return Ok(());
        }
        self.expensive.begin(y)
    }

    fn prepare(&mut self, _: &mut Stream) -> Result<(), StopReason> {
        Ok(())
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, StopReason> {
        if self.alone > 0 {
            self.alone -= 1;
            self.screen(rng)?;
            self.expensive.y.copy_from_slice(&self.cheap.y);
            let (log_density, scale) = (self.cheap.log_density, self.walk.shape.scale);
            return Ok(DrawStats::walk(log_density, self.screened, scale, 0));
        }
        let asked = std::mem::replace(&mut self.is_unasked, false);
        if asked {
            let level = &mut self.expensive;
            level.log_density = self.rejections.value(&mut *level.density, &level.y)?;
        }
        let before = self.cheap.log_density;
        let moved = self.screen(rng)?;
        let mut acceptance = 0.0;
        if moved {
            let (cheap, level) = (&mut self.cheap, &mut self.expensive);
            let value = self.rejections.value(&mut *level.density, &cheap.y)?;
            let correction = before - cheap.log_density;
            acceptance = match level.log_density == f64::NEG_INFINITY {
                // the cheap density led where the expensive one is zero: any way out is taken
                true => f64::from(u8::from(value > f64::NEG_INFINITY)),
                false => accepting(value - level.log_density + correction),
            };
            if rng.random::<f64>() < acceptance {
                level.y.copy_from_slice(&cheap.y);
                level.log_density = value;
            } else {
                cheap.y.copy_from_slice(&level.y);
                cheap.log_density = before;
            }
        }
        let (log_density, scale) = (self.expensive.log_density, self.walk.shape.scale);
        Ok(DrawStats::walk(log_density, acceptance, scale, u32::from(moved) + u32::from(asked)))
    }

    fn adapt(&mut self, _: &DrawStats, _: &mut Stream) -> Result<(), StopReason> {
        self.walk.shape.learn(self.screened, &self.expensive.y);
        Ok(())
    }

    fn freeze(&mut self, report: &mut WarmupReport) {
        self.alone = 0;
        self.walk.shape.report(report);
    }

    fn tuning(&self) -> Tuning {
        Tuning::Screened(self.walk.shape.clone(), self.screening)
    }

    fn position(&self) -> &[f64] {
        &self.expensive.y
    }

    fn log_density(&self) -> f64 {
        if self.is_unasked { self.cheap.log_density } else { self.expensive.log_density }
    }

    fn divergence(&self) -> (&[f64], f64) {
        (&self.expensive.y, 0.0)
    }

    fn rejections(&mut self) -> &mut Rejections {
        &mut self.rejections
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.expensive.density.explain(y)
    }
}
