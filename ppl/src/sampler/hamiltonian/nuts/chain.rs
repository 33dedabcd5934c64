//! A chain of the no-U-turn sampler.

use crate::density::{Location, Rejection};
use crate::model::erased::ErasedDensity;
use crate::optimize::approach;
use crate::sampler::draws::report::{DrawStats, WarmupReport};
use crate::sampler::hamiltonian::metric::Metric;
use crate::sampler::hamiltonian::system::{Hamiltonian, Position};
use crate::sampler::hamiltonian::trajectory::Trajectory;
use crate::sampler::hamiltonian::warmup::{Advice, Warmup};
use crate::sampler::run::chains::MarkovChain;
use crate::sampler::run::rejections::Rejections;
use crate::sampler::run::stop::StopReason;
use crate::sampler::run::stream::Stream;
use crate::sampler::walk::tuning::Tuning;

/// Location reported for a starting point whose density is finite but whose gradient is not.
const GRADIENT: Location = Location { statement: "gradient of the log density", file: "", line: 0 };

pub(crate) struct NutsChain<'a> {
    density: &'a dyn ErasedDensity,
    hamiltonian: Hamiltonian<'a>,
    trajectory: Trajectory,
    current: Position,
    warmup: Warmup,
    step: f64,
}

impl<'a> NutsChain<'a> {
    /// Creates a chain. `tuned` is the mass matrix and the step size of a resumed run; if it is `None`, the chain has
    /// the identity matrix and the step size 1.
    pub(crate) fn new(
        density: &'a dyn ErasedDensity,
        max_depth: u32,
        warmup: Warmup,
        tuned: Option<(Metric, f64)>,
    ) -> Self {
        let dim = density.dim();
        let mut hamiltonian = Hamiltonian::new(density);
        let mut step = 1.0;
        if let Some((metric, tuned_step)) = tuned {
            hamiltonian.metric = metric;
            step = tuned_step;
        }
        let trajectory = Trajectory::new(dim, max_depth);
        Self { density, hamiltonian, trajectory, current: Position::new(dim), warmup, step }
    }

    /// Moves a start that is far from the posterior closer to the posterior, because energy differences far from
    /// the posterior are smaller than rounding errors.
    fn approach(&mut self) -> Result<(), StopReason> {
        let near = approach(self.density, &self.current.y).map_err(StopReason::Fatal)?;
        if let Some(near) = near {
            let before = self.current.clone();
            if self.begin(&near).is_err() {
                self.current = before;
            }
        }
        Ok(())
    }

    /// Searches a new step size, and restarts the adaptation of the step size from this value.
    fn search_step(&mut self, rng: &mut Stream) -> Result<(), StopReason> {
        let scratch = self.trajectory.scratch();
        self.step = self.hamiltonian.search_step(&self.current, scratch, self.step, rng)?;
        self.warmup.step.restart(self.step);
        Ok(())
    }
}

impl MarkovChain for NutsChain<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.current.y.copy_from_slice(y);
        self.hamiltonian.evaluate(&mut self.current)?;
        match self.current.gradient.iter().find(|g| !g.is_finite()) {
            Some(&value) => Err(Rejection::NotFinite { location: GRADIENT, value }),
            None => Ok(()),
        }
    }

    fn prepare(&mut self, rng: &mut Stream) -> Result<(), StopReason> {
        if self.warmup.approaches() {
            self.approach()?;
        }
        self.warmup.first_metric(&mut self.hamiltonian.metric, &self.current);
        self.search_step(rng)
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, StopReason> {
        self.trajectory.transition(&mut self.hamiltonian, &mut self.current, self.step, rng)
    }

    fn adapt(&mut self, stats: &DrawStats, rng: &mut Stream) -> Result<(), StopReason> {
        match self.warmup.learn(stats, &self.current, &mut self.hamiltonian.metric) {
            Advice::SearchStep => self.search_step(rng),
            Advice::Continue => {
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
