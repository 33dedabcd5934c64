//! Names of phases, and the treatment of voids.

use schemars::JsonSchema;

/// Name of the phase that surrounds the grains.
pub const MATRIX: &str = "matrix";
/// Name of the phase of voids: pores, cracks.
pub const VOID: &str = "void";
/// Name of the phase of grains if the user gives no phases.
pub(crate) const GRAIN: &str = "grain";

/// Treatment of voids in an image of grey values: pores, cracks and chipped edges that are as dark as air.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum VoidTreatment {
    /// Voids are matrix.
    #[default]
    Matrix,
    /// Voids are regions of the phase [`VOID`], which a mesh does not contain.
    Removed,
}
