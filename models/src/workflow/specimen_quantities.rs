//! Quantities of measured specimens at the size of the mesh, and the files that messages name.

use std::path::{Path, PathBuf};

use super::mesh_scale::{MeshScale, MeshSize};
use crate::case::QoiCase;
use crate::experiment::Specimen;
use crate::qoi::{QoiError, Qois, Quantity};

/// The files of specimens as messages name them.
pub(super) struct SpecimenNames<'a> {
    pub(super) table: &'a Path,
    /// The curve of a specimen.
    pub(super) curve: &'a dyn Fn(&str) -> PathBuf,
}

/// Quantities of a specimen's curve at the size of the mesh.
///
/// # Errors
/// A curve that they cannot be taken from.
pub(super) fn compared(
    specimen: &Specimen,
    mesh: MeshSize,
    qoi: &QoiCase,
    quantities: &[Quantity],
) -> Result<Vec<f64>, QoiError> {
    let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
    let curve = MeshScale::of(specimen, mesh).apply(&specimen.curve);
    Qois::values_of(&curve, fraction, quantities)
}
