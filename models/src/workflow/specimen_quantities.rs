//! Quantities of measured specimens at the size of the mesh, and file names for messages about specimens.

use std::path::{Path, PathBuf};

use super::mesh_scale::{MeshScale, MeshSize};
use crate::case::QoiComparison;
use crate::experiment::Specimen;
use crate::qoi::{QoiError, Qois, Quantity};

/// File names for messages about specimens.
pub(super) struct SpecimenNames<'a> {
    pub(super) table: &'a Path,
    /// Curve file of a specimen.
    pub(super) curve: &'a dyn Fn(&str) -> PathBuf,
}

/// Computes the quantities of a specimen's curve, scaled to the size of the mesh, if there is one.
///
/// # Errors
/// Fails if a quantity cannot be computed from the curve.
pub(super) fn compared(
    specimen: &Specimen,
    mesh: Option<MeshSize>,
    qoi: &QoiComparison,
    quantities: &[Quantity],
) -> Result<Vec<f64>, QoiError> {
    let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
    let curve = MeshScale::of(specimen, mesh).apply(&specimen.curve);
    Qois::values_of(&curve, fraction, quantities)
}
