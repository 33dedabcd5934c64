//! Representation of grains in a mesh.

use serde::{Deserialize, Serialize};

/// Representation of grains in a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GrainMode {
    /// Each tetrahedron belongs entirely to the matrix or to the grain that contains most of its sample points. For
    /// comparison only: grains that share nodes form a skeleton that is far too stiff.
    Whole,
    /// The mesh conforms to the grains' surfaces; grains smaller than a few elements are omitted.
    Conforming,
    /// Each tetrahedron stores its volume fraction of grain and the normal of the interface inside the tetrahedron.
    Fraction,
    /// Grains larger than a few elements are meshed conformingly, smaller grains as volume fractions.
    #[default]
    Auto,
}
