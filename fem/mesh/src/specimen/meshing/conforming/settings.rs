//! Settings of a conforming mesh.

use crate::specimen::grains::GrainField;

/// Settings for moving a lattice onto the surfaces of grains.
pub(crate) struct Conforming<'a> {
    pub(crate) field: &'a dyn GrainField,
    /// For each grain, from number 1, whether the mesh conforms to the grain; other grains count as matrix.
    pub(crate) follows: &'a [bool],
    pub(crate) radius_mm: f64,
    pub(crate) spacing_mm: f64,
    /// Minimum dihedral angle when nodes are moved (degrees).
    pub(crate) floor_deg: f64,
    /// Whether edges on interfaces and wall are curved, and volumes are computed with curved edges.
    pub(crate) curved: bool,
}
