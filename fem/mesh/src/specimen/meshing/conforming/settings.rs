//! Settings of a conforming mesh.

use crate::mesh::WallSection;
use crate::specimen::grains::GrainField;

/// Settings for moving a lattice onto the surfaces of grains.
pub(crate) struct Conforming<'a> {
    pub(crate) field: &'a dyn GrainField,
    /// For each grain, from number 1, whether the mesh conforms to the grain; other grains count as matrix.
    pub(crate) follows: &'a [bool],
    /// Wall of the lattice, on which the nodes of the wall stay.
    pub(crate) wall: WallSection,
    pub(crate) spacing_mm: f64,
    /// Minimum dihedral angle when nodes are moved (degrees).
    pub(crate) floor_deg: f64,
    /// Whether edges on interfaces are curved. Volumes are computed with the curved edges.
    pub(crate) curved: bool,
    /// Whether edges on the wall are curved.
    pub(crate) curved_wall: bool,
}
