//! How a lattice is made to follow grains.

use crate::specimen::GrainField;

/// How a lattice is made to follow grains.
pub(in crate::specimen) struct Conforming<'a> {
    pub(in crate::specimen) field: &'a dyn GrainField,
    /// Which grains are followed, from number 1; the others count as matrix.
    pub(in crate::specimen) follows: &'a [bool],
    pub(in crate::specimen) radius_mm: f64,
    pub(in crate::specimen) spacing_mm: f64,
    /// Dihedral angle that no tetrahedron falls below by moving nodes (degrees).
    pub(in crate::specimen) floor_deg: f64,
    /// Whether edges of interfaces and wall are curved, and volumes those of curved tetrahedra.
    pub(in crate::specimen) curved: bool,
}
