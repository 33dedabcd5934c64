//! The notch of a block (`specimen.notch`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `specimen.notch`: a slot across the width of the block, in the middle of its length, open at the bottom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NotchCase {
    /// Depth in mm, along z.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub depth_mm: f64,
    /// Width in mm, along x.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub width_mm: f64,
}
