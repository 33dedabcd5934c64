//! Observers, which are called after each load step of a run.

use std::ops::ControlFlow;

use super::stepper::LoadStepper;
use crate::fields::Fields;
use crate::problem::curve::{CurvePoint, Outcome};

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

/// Takes all remaining steps of a run, or steps until the observer returns `Break`.
pub(crate) fn follow(mut run: LoadStepper, observer: &mut dyn Observer) -> Outcome {
    if !run.curve().is_empty() {
        observer.resumed(run.curve());
    }
    while let Some(point) = run.step() {
        // if the observer of one rank stops, all ranks stop
        let stop = observer.step(&point, run.fields()).is_break();
        if run.stops(stop) {
            break;
        }
    }
    run.finish()
}
