//! Settings of a conforming mesh.

use crate::mesh::WallSection;
use crate::specimen::grains::GrainField;

/// Settings for moving a lattice onto the surfaces of grains.
pub(crate) struct Conforming<'a> {
    pub(crate) field: &'a dyn GrainField,
    /// For each grain, starting with number 1, whether the mesh conforms to the grain. All other grains count as
    /// matrix.
    pub(crate) follows: &'a [bool],
    /// Wall of the lattice. Nodes on the wall stay on the wall.
    pub(crate) wall: WallSection,
    pub(crate) spacing_mm: f64,
    /// Smallest dihedral angle that the movement of nodes may cause (degrees).
    pub(crate) floor_deg: f64,
    /// Whether edges on interfaces are curved. Volumes are computed with the curved edges.
    pub(crate) curved: bool,
    /// Whether edges on the wall are curved.
    pub(crate) curved_wall: bool,
}
