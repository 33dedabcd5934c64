//! How grains become part of a mesh.

use serde::{Deserialize, Serialize};

/// How grains become part of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GrainMode {
    /// Each tetrahedron belongs to the grain that most of it lies in. For comparison: a skeleton of
    /// such grains is far too stiff.
    Whole,
    /// The mesh follows the grains' surfaces; grains smaller than a few elements are lost.
    Conforming,
    /// Each tetrahedron has its share of grain and the direction of the interface in it.
    Fraction,
    /// Grains over a few elements across are followed, the others are shares.
    #[default]
    Auto,
}
