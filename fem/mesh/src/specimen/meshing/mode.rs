//! Representation of grains in a mesh.

use serde::{Deserialize, Serialize};

/// Representation of grains in a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GrainMode {
    /// Each tetrahedron belongs entirely to the grain that covers most of it. For comparison only: such grains form a
    /// skeleton that is far too stiff.
    Whole,
    /// The mesh conforms to the grains' surfaces; grains smaller than a few elements are lost.
    Conforming,
    /// Each tetrahedron stores its volume fraction of grain and the normal of the interface in it.
    Fraction,
    /// Grains larger than a few elements are meshed conformingly, smaller ones as volume fractions.
    #[default]
    Auto,
}
