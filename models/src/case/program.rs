//! `test.program`: the load program of the top platen.

use fem::ProgramPoint;
use serde::{Deserialize, Serialize};

/// A point of `test.program`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProgramPointCase {
    /// Time in s.
    pub time_s: f64,
    /// Displacement of the top platen at this time in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_mm: Option<f64>,
    /// Force on the top platen at this time in N. No solver of this version controls the force: the validation of a case
    /// refuses this key.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
    /// Number of equal load steps of the segment that ends at this point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
}

impl ProgramPointCase {
    /// Converts to the point of `fem`. The validation of the case requires a displacement.
    pub(super) fn in_fem(&self) -> ProgramPoint {
        let Self { time_s, displacement_mm, steps, .. } = *self;
        ProgramPoint { time_s, displacement_mm: displacement_mm.unwrap_or(f64::NAN), steps }
    }
}
