//! Load programs: the displacement of the platen as a function of time.

use serde::{Deserialize, Serialize};

use super::program_steps::{ProgramSteps, SegmentSteps};
use crate::error::FemError;

/// Shortest segment of a load program, as a fraction of its duration. Shorter segments are below the resolution of the
/// clock of a run.
const SHORTEST: f64 = 1e-9;
/// Largest difference between two times that count as equal, as a fraction of the duration.
const SAME: f64 = 1e-14;

/// A point of a load program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgramPoint {
    /// Time, s.
    pub time_s: f64,
    /// Displacement of the platen at this time, mm, downwards.
    pub displacement_mm: f64,
    /// Number of equal load steps of the segment that ends at this point; `None`: the argument `usual` of
    /// [`LoadProgram::steps`] defines the steps.
    pub steps: Option<u32>,
}

impl ProgramPoint {
    /// Creates a point that does not state a number of load steps.
    pub fn new(time_s: f64, displacement_mm: f64) -> Self {
        Self { time_s, displacement_mm, steps: None }
    }
}

/// Load program: displacement of the platen as a piecewise linear function of time, from (0 s, 0 mm) through the given
/// points. The platen may hold, unload and reload.
///
/// # Example
/// A ramp of 0.1 s, a hold of 10 s, and unloading:
/// ```
/// use fem::{LoadProgram, ProgramPoint};
///
/// let program = LoadProgram::new(vec![
///     ProgramPoint::new(0.1, 0.02),
///     ProgramPoint::new(10.1, 0.02),
///     ProgramPoint::new(10.2, 0.0),
/// ])?;
/// assert_eq!(program.duration_s(), 10.2);
/// assert_eq!(program.displacement_mm(0.05), 0.01);
/// assert_eq!(program.displacement_mm(5.0), 0.02);
/// # Ok::<(), fem::FemError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LoadProgram {
    points: Vec<ProgramPoint>,
}

impl LoadProgram {
    /// Creates a program.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] if there is no point, the times do not increase, a displacement is negative or not
    /// finite, no displacement is positive, a segment is shorter than 1e-9 of the duration, or a number of steps is
    /// zero.
    pub fn new(points: Vec<ProgramPoint>) -> Result<Self, FemError> {
        let program = Self { points };
        let duration_s = program.duration_s();
        let mut before_s = 0.0;
        for (k, point) in program.points.iter().enumerate() {
            let ProgramPoint { time_s, displacement_mm, steps } = *point;
            let entity = format!("load program, point {}", k + 1);
            let refuse = |field, value, requirement| {
                Err(FemError::parameter(&entity, field, value, requirement))
            };
            if !(time_s > before_s && time_s.is_finite()) {
                return refuse(
                    "time_s",
                    time_s,
                    "later than the point before it (the program starts at 0 s)",
                );
            }
            if time_s - before_s < SHORTEST * duration_s {
                let requirement = "later than the point before it by at least 1e-9 of the duration";
                return refuse("time_s", time_s, requirement);
            }
            if !(displacement_mm >= 0.0 && displacement_mm.is_finite()) {
                return refuse(
                    "displacement_mm",
                    displacement_mm,
                    "at least 0: a platen cannot pull",
                );
            }
            if steps == Some(0) {
                return refuse("steps", 0.0, "at least 1");
            }
            before_s = time_s;
        }
        let largest_mm = program.largest_mm();
        if largest_mm > 0.0 {
            return Ok(program);
        }
        let requirement = "positive (downwards) at one point at least";
        Err(FemError::parameter("load program", "displacement_mm", largest_mm, requirement))
    }

    /// Creates a program with constant speed. The values are not checked.
    pub(crate) fn straight(duration_s: f64, displacement_mm: f64) -> Self {
        Self { points: vec![ProgramPoint::new(duration_s, displacement_mm)] }
    }

    /// Returns the points of the program in the order of time.
    pub fn points(&self) -> &[ProgramPoint] {
        &self.points
    }

    /// Returns the time of the last point, s.
    pub fn duration_s(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.time_s)
    }

    /// Largest displacement, mm.
    pub fn largest_mm(&self) -> f64 {
        self.points.iter().map(|point| point.displacement_mm).fold(0.0, f64::max)
    }

    /// Returns the displacement at a time, mm. After the last point, the displacement is constant; however, a program
    /// with a single point continues at constant speed.
    pub fn displacement_mm(&self, time_s: f64) -> f64 {
        let mut before = ProgramPoint::new(0.0, 0.0);
        let same_s = SAME * self.duration_s();
        for point in &self.points {
            if (time_s - point.time_s).abs() <= same_s {
                return point.displacement_mm;
            }
            if time_s < point.time_s {
                let fraction = (time_s - before.time_s) / (point.time_s - before.time_s);
                let moved_mm = point.displacement_mm - before.displacement_mm;
                return before.displacement_mm + fraction * moved_mm;
            }
            before = *point;
        }
        // a program with a single point continues after its end, as a test at constant speed does
        match self.points[..] {
            [only] => time_s / only.time_s * only.displacement_mm,
            _ => before.displacement_mm,
        }
    }

    /// Returns the load steps of the program: `usual` for each segment whose point does not state a number of steps.
    pub fn steps(&self, usual: SegmentSteps) -> ProgramSteps {
        let duration_s = self.duration_s();
        let segment = |point: &ProgramPoint| {
            let steps = point.steps.map_or(usual, SegmentSteps::Fixed);
            (point.time_s / duration_s, steps)
        };
        ProgramSteps::new(self.points.iter().map(segment).collect())
    }

    /// Returns the times at which the speed of the platen changes, s, without start and end.
    pub fn corners_s(&self) -> Vec<f64> {
        let inner = self.points.len().saturating_sub(1);
        self.points[..inner].iter().map(|point| point.time_s).collect()
    }
}
