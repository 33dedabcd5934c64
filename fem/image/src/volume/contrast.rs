//! The contrast of an image: whether grains or matrix are brighter.

use schemars::JsonSchema;

/// Contrast of an image: whether grains are brighter or darker than the matrix.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Contrast {
    /// Grains are brighter than the matrix, and the matrix is brighter than air.
    #[default]
    Bright,
    /// Grains are darker than the matrix, and air is darker than grains. If a cylinder is surrounded by air that is
    /// brighter than all other materials, the grey values are inverted: the matrix is then darker than air, and grains
    /// are darker than the matrix.
    Dark,
}
