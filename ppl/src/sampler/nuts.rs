//! The no-U-turn sampler.

use std::{ops::RangeInclusive, sync::atomic::AtomicBool};

use super::{
    chains::{Chains, Covariance, DrawStats, WarmupReport},
    error::SampleError,
    hamiltonian::{Hamiltonian, Point},
    metric::Metric,
    progress::Progress,
    rejections::{Rejections, Stop},
    run::{Kernel, Stream},
    settings::{Init, Run, shared_settings},
    trajectory::Trajectory,
    tuning::Tuning,
    warmup::{Advice, Rule, Warmup},
};
use crate::{
    any::AnyDensity,
    bound::Bound,
    density::{LogDensity, Place, Rejection},
    model::Model,
    optimize::approach,
    posterior::Posterior,
};

/// Doublings that a trajectory may be allowed.
pub(super) const DEPTHS: RangeInclusive<u32> = 1..=20;

/// The no-U-turn sampler: Hamiltonian trajectories whose length finds itself.
///
/// Multinomial NUTS with the generalised criterion (Betancourt 2017), target acceptance 0.8, at
/// most 10 doublings, starts uniform on (−2, 2), 4 chains with 1000 draws after 700 of warmup.
///
/// A start so far from the posterior that energies there have no digits for their differences, as
/// where a rate is e⁸⁰, is left by a few steps of L-BFGS first, which end well before the mode.
/// The default warmup fits the inverse mass matrix M⁻¹ to draws y and scores ∇ln p, by the least
/// Fisher divergence. It does so every 10 draws in the first 30 % of the warmup, from the later
/// half of the draws so far, and then in windows of 80 · 1.5ⁿ draws; the last 15 % tune the step
/// alone. Each time it chooses between
/// - a diagonal, `√(var y / var ∇ln p)`, and
/// - up to 50 dimensions the dense geometric mean of `cov y` and `(cov ∇ln p)⁻¹`, above that the
///   same in up to 32 directions beside the diagonal,
///
/// by the divergence on the last third of the draws, when fitted to those before; from the second
/// window on, the map in use competes too. A divergence in the last 15 % raises the target to 0.9; one
/// in 75 transitions of the later half raises it to 0.95. [`Nuts::stan_compatible`] takes Stan's warmup, which needs more gradients on most posteriors,
/// but steps more carefully where scales are unknown and coordinates many (horseshoes, spectral
/// Gaussian processes). After the warmup nothing is adapted; what
/// was decided, and when, is in [`WarmupReport`].
///
/// A point that the density rejects ends its trajectory as a divergence and is counted by its
/// place in the model. A fatal error or the interrupt flag ends the run and keeps its draws; what was
/// interrupted, in the warmup too, goes on by [`resume`](Nuts::resume) from the [`Chains`] of
/// [`run`](Nuts::run).
///
/// # Errors
/// [`SampleError`] if a setting is out of range or a chain finds no starting point.
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
/// [`LogDensity`] shows a density that is not a model.
///
/// # References
/// Hoffman & Gelman, JMLR 15 (2014) 1593; Betancourt, arXiv 1701.02434; Seyboldt, Carlson &
/// Carpenter 2026, arXiv 2603.18845.
#[derive(Clone, Debug)]
pub struct Nuts<'a> {
    pub(super) run: Run<'a>,
    rule: Rule,
    target_accept: f64,
    max_depth: u32,
    /// Mass matrix and step of each chain, from an earlier run.
    pub(super) warm: Option<Vec<(Covariance, f64)>>,
}

impl Default for Nuts<'_> {
    fn default() -> Self {
        Self {
            run: Run::new(700, 1000),
            rule: Rule::Fisher,
            target_accept: 0.8,
            max_depth: 10,
            warm: None,
        }
    }
}

impl<'a> Nuts<'a> {
    /// Stan's warmup: 1000 draws, with variances of the draws in doubling windows between 75 draws
    /// and 50 draws in which only the step is tuned (15 / 75 / 10 % below 150 draws, the step alone
    /// below 20).
    ///
    /// Reference: Stan Reference Manual, *HMC algorithm parameters*.
    pub fn stan_compatible() -> Self {
        Self { run: Run::new(1000, 1000), rule: Rule::Stan, ..Self::default() }
    }

    shared_settings!();

    /// Mean acceptance that the step size is tuned to, between 0 and 1.
    pub fn target_accept(mut self, target: f64) -> Self {
        self.target_accept = target;
        self
    }

    /// Most doublings of a trajectory, 1 to 20: at most `2^max_depth − 1` leapfrogs a draw.
    pub fn max_depth(mut self, depth: u32) -> Self {
        self.max_depth = depth;
        self
    }

    /// Samples any log density.
    ///
    /// # Errors
    /// See [`Nuts`].
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Chains, SampleError> {
        self.run_any(density)
    }

    fn run_any(&self, density: &dyn AnyDensity) -> Result<Chains, SampleError> {
        let refuse = |setting, value, mend| Err(SampleError::Setting { setting, value, mend });
        if !(self.target_accept > 0.0 && self.target_accept < 1.0) {
            let value = self.target_accept.to_string();
            return refuse("target_accept", value, "give a number between 0 and 1, as 0.8");
        }
        if !DEPTHS.contains(&self.max_depth) {
            return refuse("max_depth", self.max_depth.to_string(), "give 1 to 20, as 10");
        }
        let dim = density.dim();
        let tuned = self.tuned_maps(dim)?;
        self.run.validate(dim)?;
        let chains = self.run.execute_each(dim, |number| {
            let tuned = tuned.as_ref().map(|tuned| tuned[number].clone());
            let (warmup, target, warm) = (self.run.warmup, self.target_accept, tuned.is_some());
            let warmup = Warmup::new(self.rule, dim, warmup, target, warm);
            NutsChain::new(density, self.max_depth, warmup, tuned)
        })?;
        let chains = Chains::new(dim, chains, self.run.thin);
        Ok(Chains { max_depth: Some(self.max_depth), ..chains })
    }

    /// Samples a model: the draws with everything the model names.
    ///
    /// # Errors
    /// See [`Nuts`]; also if the model cannot be evaluated, or a chain was stopped before its first
    /// draw.
    pub fn sample<M: Model>(&self, model: &Bound<M>) -> Result<Posterior, SampleError> {
        Posterior::sample(model, self.run.seed, &|density| self.run_any(density))
    }
}

/// Where a starting point with a finite density but no finite gradient is rejected.
const GRADIENT: Place = Place { statement: "gradient of the log density", file: "", line: 0 };

pub(super) struct NutsChain<'a> {
    density: &'a dyn AnyDensity,
    hamiltonian: Hamiltonian<'a>,
    trajectory: Trajectory,
    current: Point,
    warmup: Warmup,
    step: f64,
    /// Mass matrix and step come from an earlier run.
    warm: bool,
}

impl<'a> NutsChain<'a> {
    /// `tuned`: mass matrix and step of an earlier run.
    pub(super) fn new(
        density: &'a dyn AnyDensity,
        max_depth: u32,
        warmup: Warmup,
        tuned: Option<(Metric, f64)>,
    ) -> Self {
        let dim = density.dim();
        let mut hamiltonian = Hamiltonian::new(density);
        let warm = tuned.is_some();
        let mut step = 1.0;
        if let Some((metric, tuned_step)) = tuned {
            hamiltonian.metric = metric;
            step = tuned_step;
        }
        let trajectory = Trajectory::new(dim, max_depth);
        Self { density, hamiltonian, trajectory, current: Point::new(dim), warmup, step, warm }
    }

    /// Leaves a start that is too far from the posterior for the energy to tell anything.
    fn approach(&mut self) -> Result<(), Stop> {
        let near = approach(self.density, &self.current.y).map_err(|e| Stop(e.to_string()))?;
        if let Some(near) = near {
            let before = self.current.clone();
            if self.begin(&near).is_err() {
                self.current = before;
            }
        }
        Ok(())
    }

    /// Searches the step anew, and restarts its adaptation there.
    fn search_step(&mut self, rng: &mut Stream) -> Result<(), Stop> {
        let scratch = self.trajectory.scratch();
        self.step = self.hamiltonian.search_step(&self.current, scratch, self.step, rng)?;
        self.warmup.step.restart(self.step);
        Ok(())
    }
}

impl Kernel for NutsChain<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.current.y.copy_from_slice(y);
        self.hamiltonian.evaluate(&mut self.current)?;
        match self.current.gradient.iter().find(|g| !g.is_finite()) {
            Some(&value) => Err(Rejection::NotFinite { place: GRADIENT, value }),
            None => Ok(()),
        }
    }

    fn prepare(&mut self, rng: &mut Stream) -> Result<(), Stop> {
        if self.warm {
            self.warmup.step.restart(self.step);
            return Ok(());
        }
        if self.warmup.approaches() {
            self.approach()?;
        }
        self.warmup.first_metric(&mut self.hamiltonian.metric, &self.current);
        self.search_step(rng)
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, Stop> {
        self.trajectory.transition(&mut self.hamiltonian, &mut self.current, self.step, rng)
    }

    fn adapt(&mut self, stats: &DrawStats, rng: &mut Stream) -> Result<(), Stop> {
        match self.warmup.learn(stats, &self.current, &mut self.hamiltonian.metric) {
            Advice::SearchStep => self.search_step(rng),
            Advice::GoOn => {
                self.step = self.warmup.step.current();
                Ok(())
            }
        }
    }

    fn tuning(&self) -> Tuning {
        Tuning::Hamiltonian {
            step: self.step,
            covariance: self.hamiltonian.metric.covariance(),
            warmup: self.warmup.clone(),
        }
    }

    fn tuned(&self) -> Option<Tuning> {
        None
    }

    fn freeze(&mut self, report: &mut WarmupReport) {
        self.step = self.warmup.step.average();
        report.step_size = self.step;
        report.covariance = self.hamiltonian.metric.covariance();
        self.warmup.report(report);
    }

    fn position(&self) -> &[f64] {
        &self.current.y
    }

    fn log_density(&self) -> f64 {
        self.current.log_density
    }

    fn divergence(&self) -> (&[f64], f64) {
        let (position, error) = &self.trajectory.divergence;
        (position, *error)
    }

    fn rejections(&mut self) -> &mut Rejections {
        &mut self.hamiltonian.rejections
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.hamiltonian.explain(y)
    }
}
