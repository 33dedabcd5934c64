//! Load steps of a load program, segment by segment.

use super::clock::{SAME, is_later};
use super::controller::{Progress, Step, StepController};
use super::steps::{AdaptiveSteps, CUT, FixedSteps, GROWTH, LEAST};
use crate::error::FemError;

/// Load steps of one segment of a load program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentSteps {
    /// Equal steps. A step without equilibrium is divided, and the curve contains only the requested points.
    Fixed(u32),
    /// Steps that grow after convergence and are reduced after a failure. `first` and `largest` are fractions of the
    /// duration of the segment.
    Adaptive(AdaptiveSteps),
}

impl Default for SegmentSteps {
    fn default() -> Self {
        Self::Adaptive(AdaptiveSteps::default())
    }
}

/// Load steps of a load program: each segment has its own [`SegmentSteps`], and a load step ends at the end of each
/// segment.
///
/// Created by [`LoadProgram::steps`](crate::LoadProgram::steps).
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramSteps {
    /// End of each segment, as a fraction of the duration, and the steps of the segment.
    segments: Vec<(f64, SegmentSteps)>,
}

impl ProgramSteps {
    /// Creates the steps of segments. Each segment is given by its end, as a fraction of the duration, and by the
    /// steps of the segment.
    pub(super) fn new(segments: Vec<(f64, SegmentSteps)>) -> Self {
        Self { segments }
    }

    /// Returns the segment that contains the next step after the position `passed`: its start and its end, as
    /// fractions of the duration, and its steps.
    fn segment(&self, passed: f64) -> Option<(f64, f64, SegmentSteps)> {
        let mut start = 0.0;
        for &(end, steps) in &self.segments {
            if is_later(end, passed) {
                return Some((start, end, steps));
            }
            start = end;
        }
        None
    }
}

impl StepController for ProgramSteps {
    fn next(&self, run: &Progress) -> Option<Step> {
        let (start, end, steps) = self.segment(run.passed)?;
        let width = end - start;
        let [first, largest] = match steps {
            SegmentSteps::Fixed(steps) => [1.0 / f64::from(steps); 2],
            SegmentSteps::Adaptive(AdaptiveSteps { first, largest }) => [first, largest],
        };
        // the last step of another segment does not limit the first step of this segment
        let taken = run.taken.filter(|_| is_later(run.passed, start));
        let fraction = match (run.failed, taken) {
            (Some(failed), _) if failed.fraction() <= LEAST * width => return None,
            (Some(failed), _) => CUT * failed.fraction(),
            (None, Some(taken)) => (largest * width).min(GROWTH * taken.fraction()),
            (None, None) => first * width,
        };
        Some(Step::Advance(fraction))
    }

    fn next_mark(&self, run: &Progress) -> Option<f64> {
        let (start, end, steps) = self.segment(run.passed)?;
        let SegmentSteps::Fixed(steps) = steps else { return None };
        let width = end - start;
        let count = f64::from(steps);
        let completed = ((run.passed - start + SAME) / width * count).floor();
        let next = completed.max(0.0) + 1.0;
        Some(if next >= count { end } else { start + width * next / count })
    }

    fn validate(&self) -> Result<(), FemError> {
        self.segments.iter().try_for_each(|(_, steps)| match steps {
            SegmentSteps::Fixed(steps) => FixedSteps(*steps).validate(),
            SegmentSteps::Adaptive(steps) => steps.validate(),
        })
    }
}
