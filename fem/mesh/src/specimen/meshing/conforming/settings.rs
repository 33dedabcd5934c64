//! Settings of a conforming mesh.

use crate::specimen::grains::GrainField;

/// Settings for moving a lattice onto the surfaces of grains.
pub(in crate::specimen::meshing) struct Conforming<'a> {
    pub(in crate::specimen::meshing) field: &'a dyn GrainField,
    /// For each grain, from number 1, whether the mesh conforms to it; other grains count as matrix.
    pub(in crate::specimen::meshing) follows: &'a [bool],
    pub(in crate::specimen::meshing) radius_mm: f64,
    pub(in crate::specimen::meshing) spacing_mm: f64,
    /// Lower limit of the dihedral angles when nodes are moved (degrees).
    pub(in crate::specimen::meshing) floor_deg: f64,
    /// Whether edges on interfaces and wall are curved, and volumes are computed with curved edges.
    pub(in crate::specimen::meshing) curved: bool,
}
