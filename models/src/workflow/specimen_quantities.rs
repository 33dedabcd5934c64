//! Quantities of measured specimens at the height of the mesh, and the files that messages name.

use std::path::{Path, PathBuf};

use crate::case::QoiCase;
use crate::experiment::Specimen;
use crate::qoi::{QoiError, Qois, Quantity};

/// The files of specimens as messages name them.
pub(super) struct SpecimenNames<'a> {
    pub(super) table: &'a Path,
    /// The curve of a specimen.
    pub(super) curve: &'a dyn Fn(&str) -> PathBuf,
}

/// Quantities of a specimen's curve at the height of the mesh.
///
/// # Errors
/// A curve that they cannot be taken from.
pub(super) fn compared(
    specimen: &Specimen,
    mesh_height_mm: f64,
    qoi: &QoiCase,
    quantities: &[Quantity],
) -> Result<Vec<f64>, QoiError> {
    let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
    let curve = specimen.curve.scale_displacement(height_factor(specimen, mesh_height_mm));
    Qois::values_of(&curve, fraction, quantities)
}

/// What displacements of a specimen are multiplied by to compare with the mesh.
pub(super) fn height_factor(specimen: &Specimen, mesh_height_mm: f64) -> f64 {
    let factor = mesh_height_mm / specimen.height_mm;
    if (factor - 1.0).abs() > 1e-9 { factor } else { 1.0 }
}
