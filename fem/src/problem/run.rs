//! Whole runs, with somebody who follows them.

use std::ops::ControlFlow;

use super::checkpoint::Checkpoint;
use super::curve::{CurvePoint, Outcome};
use super::problem::Problem;
use super::stepper::LoadStepper;
use crate::error::FemError;
use crate::fields::Fields;

/// Follows a running test.
///
/// `()` is an observer that does nothing; so is every closure of the right type an observer.
pub trait Observer {
    /// Called after each load step; `Break` ends the test with [`End::Interrupted`](crate::End).
    fn step(&mut self, point: &CurvePoint, fields: &Fields) -> ControlFlow<()>;

    /// Called once before the first step when a run goes on from a checkpoint, with the curve so far.
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
    /// Begins a run, to be driven step by step on the calling thread.
    pub fn start(&self) -> LoadStepper<'_> {
        LoadStepper::new(self)
    }

    /// Like [`start`](Self::start), with the state saved every so many load steps; if there is a
    /// saved state, the run goes on from there, bit by bit as if it had not stopped.
    ///
    /// The curve depends on `checkpoint.every` within the solver's tolerance, but not on where the
    /// run was interrupted. The file stays when the run ends.
    ///
    /// # Errors
    /// [`FemError::Checkpoint`] for a file that is damaged or of another problem (of what the
    /// functions of the [`Conditions`](crate::Conditions) compute, only the description is compared),
    /// [`FemError::Io`] for one that cannot be read.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<LoadStepper<'_>, FemError> {
        LoadStepper::resume(self, checkpoint)
    }

    /// Runs to the end, or until the observer breaks.
    pub fn run(&self, observer: &mut dyn Observer) -> Outcome {
        follow(self.start(), observer)
    }

    /// Runs with the state on disk, as [`resume`](Self::resume) does.
    ///
    /// # Errors
    /// As there.
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
    // an error is the end of the run and stands in its outcome
    while let Ok(Some(point)) = run.step() {
        // one rank that is told to stop stops all
        let stop = observer.step(&point, run.fields()).is_break();
        if run.stops(stop) {
            break;
        }
    }
    run.finish()
}
