//! Representation of grains in a mesh.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Representation of grains in a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GrainMode {
    /// Each tetrahedron belongs entirely to the matrix or to the grain that contains most of its sample points. This
    /// mode is for comparisons only: grains that share nodes form a skeleton that is far too stiff.
    Whole,
    /// Nodes lie on the grains' surfaces (the mesh conforms to the grains); grains smaller than a few elements are
    /// omitted.
    Conforming,
    /// Each tetrahedron stores its volume fraction of grain and the normal of the interface inside the tetrahedron.
    Fraction,
    /// Grains larger than a few elements are meshed conformingly, smaller grains are represented by volume fractions.
    #[default]
    Auto,
}
