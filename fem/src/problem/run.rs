//! Complete runs, with an observer.

use std::ops::ControlFlow;

use super::checkpoint::Checkpoint;
use super::curve::{CurvePoint, Outcome};
use super::problem::Problem;
use super::stepper::LoadStepper;
use crate::error::FemError;
use crate::fields::Fields;

/// Callback that observes a running test.
///
/// `()` is an observer that does nothing; a closure with the signature of [`step`](Self::step) is an observer too.
pub trait Observer {
    /// Called after each load step; `Break` ends the test with [`End::Interrupted`](crate::End).
    fn step(&mut self, point: &CurvePoint, fields: &Fields) -> ControlFlow<()>;

    /// Called once before the first step if a run resumes from a checkpoint, with the curve so far.
    fn resumed(&mut self, _curve: &[CurvePoint]) {}
}

impl Observer for () {
    fn step(&mut self, _: &CurvePoint, _: &Fields) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl<F: FnMut(&CurvePoint, &Fields) -> ControlFlow<()>> Observer for F {
    fn step(&mut self, point: &CurvePoint, fields: &Fields) -> ControlFlow<()> {
        self(point, fields)
    }
}

impl Problem {
    /// Starts a run that the caller advances step by step on the calling thread.
    pub fn start(&self) -> LoadStepper<'_> {
        LoadStepper::new(self)
    }

    /// Like [`start`](Self::start), but saves the state every `checkpoint.every` load steps. If a saved state exists,
    /// the run resumes from it, with bitwise the same result as an uninterrupted run.
    ///
    /// The curve depends on `checkpoint.every` within the solver's tolerance, but not on where the run was
    /// interrupted. The file is kept when the run ends.
    ///
    /// # Errors
    /// [`FemError::Checkpoint`] for a file that is damaged or belongs to another problem (the functions of the
    /// [`Conditions`](crate::Conditions) are compared by their description only); [`FemError::Io`] for a file that
    /// cannot be read.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<LoadStepper<'_>, FemError> {
        LoadStepper::resume(self, checkpoint)
    }

    /// Runs to the end, or until the observer returns `Break`.
    pub fn run(&self, observer: &mut dyn Observer) -> Outcome {
        follow(self.start(), observer)
    }

    /// Runs like [`run`](Self::run), with the state saved as by [`resume`](Self::resume).
    ///
    /// # Errors
    /// As [`resume`](Self::resume).
    pub fn run_resumable(
        &self,
        checkpoint: &Checkpoint,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, FemError> {
        Ok(follow(self.resume(checkpoint)?, observer))
    }
}

fn follow(mut run: LoadStepper, observer: &mut dyn Observer) -> Outcome {
    if !run.curve().is_empty() {
        observer.resumed(run.curve());
    }
    // an error ends the run and is part of its outcome
    while let Ok(Some(point)) = run.step() {
        // if the observer of one rank stops, all ranks stop
        let stop = observer.step(&point, run.fields()).is_break();
        if run.stops(stop) {
            break;
        }
    }
    run.finish()
}
