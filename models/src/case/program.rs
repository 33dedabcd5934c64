//! `test.program`: the load program of the top platen.

use fem::{PlatenLoad, ProgramPoint};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A point of `test.program`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProgramPointCase {
    /// Time in s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_s: f64,
    /// Displacement of the top platen at this time in mm. A point has either a displacement or a force.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1e3))]
    pub displacement_mm: Option<f64>,
    /// Force on the top platen at this time in N. The displacement of the platen is then a result.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1e9))]
    pub force_n: Option<f64>,
    /// Number of equal load steps of the segment that ends at this point.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub steps: Option<u32>,
}

impl ProgramPointCase {
    /// Converts to the point of `fem`. The validation of the case requires a displacement or a force.
    pub(super) fn in_fem(&self) -> ProgramPoint {
        let Self { time_s, displacement_mm, force_n, steps } = *self;
        let load = match force_n {
            Some(force_n) => PlatenLoad::Force(force_n),
            None => PlatenLoad::Displacement(displacement_mm.unwrap_or(f64::NAN)),
        };
        ProgramPoint { time_s, load, steps }
    }
}
