//! Transition kernel of delayed-acceptance Metropolis.

use rand::Rng;

use crate::density::Rejection;
use crate::model::erased::{ErasedDensity, Evaluator};
use crate::sampler::draws::report::{DrawStats, WarmupReport};
use crate::sampler::run::chains::MarkovChain;
use crate::sampler::run::rejections::{Rejections, accepting, finite};
use crate::sampler::run::stop::StopReason;
use crate::sampler::run::stream::Stream;
use crate::sampler::walk::proposal::{Proposal, ProposalShape};
use crate::sampler::walk::screening::Screening;
use crate::sampler::walk::tuning::Tuning;

/// A density raised to a power, with the current point of the chain.
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

    /// Returns the log density at the point `y`. If the density rejects the point, counts the rejection and returns
    /// −∞.
    fn value(&mut self, y: &[f64], rejections: &mut Rejections) -> Result<f64, StopReason> {
        Ok(self.power * rejections.value(&mut *self.density, y)?)
    }
}

/// Transition kernel of delayed acceptance, with the current state of the chain under both densities.
pub(crate) struct Delayed<'a> {
    cheap: Evaluated<'a>,
    expensive: Evaluated<'a>,
    next: Vec<f64>,
    walk: Proposal,
    screening: Screening,
    /// Number of remaining transitions that use the cheap density only.
    alone: usize,
    /// Whether the expensive density has not yet been evaluated at the current point.
    is_unevaluated: bool,
    /// Acceptance probability by which the proposal is tuned: the mean over the most recent screening, or the
    /// probability of the most recent step without screening.
    walked: f64,
    rejections: Rejections,
}

impl<'a> Delayed<'a> {
    /// Creates the kernel. All transitions use both densities.
    pub(crate) fn new(
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
            is_unevaluated: false,
            walked: 0.0,
            rejections: Rejections::default(),
        }
    }

    /// Sets the number of transitions that use the cheap density only, and whether the expensive density has not yet
    /// been evaluated at the starting point.
    pub(crate) fn screened_warmup(self, alone: usize, is_unevaluated: bool) -> Self {
        Self { alone, is_unevaluated, ..self }
    }

    /// Runs the screening, that is, the random-walk steps on the cheap density. Returns whether the point changed.
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
        self.walked = sum / f64::from(self.screening.steps);
        Ok(moved)
    }

    /// Performs one random-walk Metropolis step on the expensive density. Returns the acceptance probability of the
    /// step.
    fn plain_step(&mut self, rng: &mut Stream) -> Result<f64, StopReason> {
        let level = &mut self.expensive;
        self.walk.propose(&level.y, &mut self.next, rng);
        let value = level.value(&self.next, &mut self.rejections)?;
        let acceptance = match level.log_density == f64::NEG_INFINITY {
            true => f64::from(u8::from(value > f64::NEG_INFINITY)),
            false => accepting(value - level.log_density),
        };
        self.walked = acceptance;
        if rng.random::<f64>() < acceptance {
            self.cheap.log_density = self.cheap.value(&self.next, &mut self.rejections)?;
            self.cheap.y.copy_from_slice(&self.next);
            level.y.copy_from_slice(&self.next);
            level.log_density = value;
        }
        Ok(acceptance)
    }

    /// Runs the screening from the current point, and accepts or rejects its end point with the expensive density.
    /// Returns the acceptance probability, and whether the expensive density was evaluated.
    fn screened_step(&mut self, rng: &mut Stream) -> Result<(f64, bool), StopReason> {
        let before = self.cheap.log_density;
        if !self.screen(rng)? {
            return Ok((0.0, false));
        }
        let (cheap, level) = (&mut self.cheap, &mut self.expensive);
        let value = self.rejections.value(&mut *level.density, &cheap.y)?;
        let correction = before - cheap.log_density;
        let acceptance = match level.log_density == f64::NEG_INFINITY {
            // the current point has zero expensive density: accept every point with a positive expensive density
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
        Ok((acceptance, true))
    }
}

impl MarkovChain for Delayed<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.cheap.begin(y)?;
        if self.is_unevaluated {
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
            return Ok(DrawStats::walk(log_density, self.walked, scale, 0));
        }
        let evaluates_current = std::mem::replace(&mut self.is_unevaluated, false);
        if evaluates_current {
            let level = &mut self.expensive;
            level.log_density = self.rejections.value(&mut *level.density, &level.y)?;
        }
        let share = self.screening.plain_share;
        // with a share of 0, no random number is drawn, so that the draws are the same as before this setting existed
        let is_plain = share > 0.0 && rng.random::<f64>() < share;
        let (acceptance, decided) = match is_plain {
            true => (self.plain_step(rng)?, true),
            false => self.screened_step(rng)?,
        };
        let (log_density, scale) = (self.expensive.log_density, self.walk.shape.scale);
        Ok(DrawStats::walk(
            log_density,
            acceptance,
            scale,
            u32::from(decided) + u32::from(evaluates_current),
        ))
    }

    fn adapt(&mut self, _: &DrawStats, _: &mut Stream) -> Result<(), StopReason> {
        self.walk.shape.learn(self.walked, &self.expensive.y);
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
        if self.is_unevaluated { self.cheap.log_density } else { self.expensive.log_density }
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
