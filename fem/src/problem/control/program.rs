//! Load programs: the displacement of the platen, or its force, as a function of time.

use serde::{Deserialize, Serialize};

use super::program_steps::{ProgramSteps, SegmentSteps};
use crate::error::FemError;

/// Shortest segment of a load program, as a fraction of its duration. Shorter segments are below the resolution of the
/// clock of a run.
const SHORTEST: f64 = 1e-9;
/// Largest difference between two times that count as equal, as a fraction of the duration.
const SAME: f64 = 1e-14;

/// Displacement or force of the platen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PlatenLoad {
    /// Displacement, mm, downwards.
    Displacement(f64),
    /// Force on the specimen, N, downwards. The displacement of the platen is then a result.
    Force(f64),
}

/// A point of a load program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgramPoint {
    /// Time, s.
    pub time_s: f64,
    /// Displacement or force of the platen at this time. The same quantity is prescribed in the segment that ends at
    /// this point.
    pub load: PlatenLoad,
    /// Number of equal load steps of the segment that ends at this point; `None`: the argument `usual` of
    /// [`LoadProgram::steps`] defines the steps.
    pub steps: Option<u32>,
}

impl ProgramPoint {
    /// Creates a point with a displacement (mm) that does not state a number of load steps.
    pub fn new(time_s: f64, displacement_mm: f64) -> Self {
        Self { time_s, load: PlatenLoad::Displacement(displacement_mm), steps: None }
    }

    /// Creates a point with a force (N) that does not state a number of load steps.
    pub fn force(time_s: f64, force_n: f64) -> Self {
        Self { time_s, load: PlatenLoad::Force(force_n), steps: None }
    }

    /// Returns the displacement, mm; `None` at a point with a force.
    pub fn displacement_mm(&self) -> Option<f64> {
        match self.load {
            PlatenLoad::Displacement(displacement_mm) => Some(displacement_mm),
            PlatenLoad::Force(_) => None,
        }
    }

    /// Returns the force, N; `None` at a point with a displacement.
    pub fn force_n(&self) -> Option<f64> {
        match self.load {
            PlatenLoad::Displacement(_) => None,
            PlatenLoad::Force(force_n) => Some(force_n),
        }
    }
}

/// Load program: displacement or force of the platen as a piecewise linear function of time, from 0 mm and 0 N at 0 s
/// through the given points. The platen may hold, unload and reload.
///
/// In the segment before a point with a displacement, the displacement is linear in time. In the segment before a point
/// with a force, the force is linear in time, and the displacement is a result. A segment starts at the displacement or
/// force that the platen has reached at the end of the segment before it.
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
/// assert_eq!(program.displacement_mm(0.05), Some(0.01));
/// assert_eq!(program.displacement_mm(5.0), Some(0.02));
///
/// // a ramp to 100 N and a hold at 100 N: creep
/// let program =
///     LoadProgram::new(vec![ProgramPoint::force(0.1, 100.0), ProgramPoint::force(10.1, 100.0)])?;
/// assert!(program.prescribes_force());
/// assert_eq!(program.displacement_mm(5.0), None);
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
    /// [`FemError::OutOfRange`] if there is no point, the times do not increase, a displacement or force is negative or
    /// not finite, no displacement and no force is positive, a segment is shorter than 1e-9 of the duration, or a number
    /// of steps is zero.
    pub fn new(points: Vec<ProgramPoint>) -> Result<Self, FemError> {
        let program = Self { points };
        let duration_s = program.duration_s();
        let mut before_s = 0.0;
        for (k, point) in program.points.iter().enumerate() {
            let ProgramPoint { time_s, load, steps } = *point;
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
            let (field, value) = match load {
                PlatenLoad::Displacement(displacement_mm) => ("displacement_mm", displacement_mm),
                PlatenLoad::Force(force_n) => ("force_n", force_n),
            };
            if !(value >= 0.0 && value.is_finite()) {
                return refuse(field, value, "at least 0: a platen cannot pull");
            }
            if steps == Some(0) {
                return refuse("steps", 0.0, "at least 1");
            }
            before_s = time_s;
        }
        let forces = program.points.iter().filter_map(ProgramPoint::force_n);
        let largest_mm = program.largest_mm();
        if largest_mm.max(forces.fold(0.0, f64::max)) > 0.0 {
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

    /// Largest displacement of the points that state a displacement, mm; zero if no point states a displacement.
    pub fn largest_mm(&self) -> f64 {
        self.points.iter().filter_map(ProgramPoint::displacement_mm).fold(0.0, f64::max)
    }

    /// Whether the program prescribes a force at one point at least. The displacement of the platen is then a result.
    pub fn prescribes_force(&self) -> bool {
        self.points.iter().any(|point| point.force_n().is_some())
    }

    /// Returns the displacement at a time, mm; `None` in a segment that starts or ends at a point with a force. After the
    /// last point, the displacement is constant; however, a program with a single point continues at constant speed.
    pub fn displacement_mm(&self, time_s: f64) -> Option<f64> {
        let mut before = ProgramPoint::new(0.0, 0.0);
        let same_s = SAME * self.duration_s();
        for point in &self.points {
            if (time_s - point.time_s).abs() <= same_s {
                return point.displacement_mm();
            }
            if time_s < point.time_s {
                let (start_mm, end_mm) = (before.displacement_mm()?, point.displacement_mm()?);
                let fraction = (time_s - before.time_s) / (point.time_s - before.time_s);
                return Some(start_mm + fraction * (end_mm - start_mm));
            }
            before = *point;
        }
        // a program with a single point continues after its end, as a test at constant speed does
        match self.points[..] {
            [only] => Some(time_s / only.time_s * only.displacement_mm()?),
            _ => before.displacement_mm(),
        }
    }

    /// Returns the displacement or the force that the program prescribes at a time. `reached` are the displacement (mm)
    /// and the force (N) at the start of the segment; they are used where the program does not state them.
    pub(crate) fn load_at(&self, time_s: f64, reached: [f64; 2]) -> PlatenLoad {
        let (start, end, fraction) = self.segment(time_s);
        let linear =
            |from: f64, to: f64| if fraction == 1.0 { to } else { from + fraction * (to - from) };
        match end.load {
            PlatenLoad::Displacement(to) => {
                PlatenLoad::Displacement(linear(start.displacement_mm().unwrap_or(reached[0]), to))
            }
            PlatenLoad::Force(to) => {
                PlatenLoad::Force(linear(start.force_n().unwrap_or(reached[1]), to))
            }
        }
    }

    /// Returns the factor by which a change of the start value of a segment changes the prescribed value at a time. The
    /// factor is zero if the program states the start value.
    pub(crate) fn effect_of_start(&self, time_s: f64) -> f64 {
        let (start, end, fraction) = self.segment(time_s);
        let is_stated = start.time_s == 0.0
            || start.displacement_mm().is_some() == end.displacement_mm().is_some();
        if is_stated { 0.0 } else { 1.0 - fraction }
    }

    /// Returns start and end of the segment that contains a time, and the fraction of the segment that has passed. The
    /// end of a segment belongs to the segment.
    fn segment(&self, time_s: f64) -> (ProgramPoint, ProgramPoint, f64) {
        let same_s = SAME * self.duration_s();
        let index = self.points.iter().position(|point| time_s <= point.time_s + same_s);
        let index = index.unwrap_or(self.points.len() - 1);
        let end = self.points[index];
        let start = match index {
            // the specimen is unloaded at the start of the test
            0 => ProgramPoint {
                load: match end.load {
                    PlatenLoad::Displacement(_) => PlatenLoad::Displacement(0.0),
                    PlatenLoad::Force(_) => PlatenLoad::Force(0.0),
                },
                ..ProgramPoint::new(0.0, 0.0)
            },
            _ => self.points[index - 1],
        };
        let passed = (time_s - start.time_s) / (end.time_s - start.time_s);
        let fraction = if (time_s - end.time_s).abs() <= same_s { 1.0 } else { passed.min(1.0) };
        (start, end, fraction)
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
