//! Images of several specimens: the files that the stages `segment` and `mesh` leave of each.
//!
//! Images are counted from 1. The first is the case's own, `specimen.image.stack` or `labels`, whose files have the names that they
//! have where there is no other.

use std::path::PathBuf;

use super::WorkflowError;
use super::inputs::Inputs;
use super::specimen::Scanned;
use crate::case::{Microstructure, SpecimenGeometry};

/// The case's own image.
pub(super) const OWN: usize = 1;

/// The name of what is segmented, or known of it, of an image.
pub(super) fn segmented_file(image: usize, name: &str) -> String {
    if image == OWN { name.to_owned() } else { format!("images/{image}-{name}") }
}

/// The name of the mesh of an image, with its ending or that of a table beside it.
pub(super) fn mesh_file(image: usize, ending: &str) -> String {
    if image == OWN { format!("mesh.{ending}") } else { format!("meshes/{image}.{ending}") }
}

/// How many images the runs of the design are spread over; one where there are no further ones.
///
/// # Errors
/// A case without geometry.
pub(super) fn count(inputs: &Inputs<'_>) -> Result<usize, WorkflowError> {
    Ok(OWN + names(inputs)?.len())
}

/// The names of the further images that runs are made on, from the second on.
///
/// # Errors
/// A case without geometry.
pub(super) fn names(inputs: &Inputs<'_>) -> Result<Vec<String>, WorkflowError> {
    Ok(match inputs.geometry()? {
        // what all runs are made on matters to a case with further images alone
        SpecimenGeometry::Image { further, .. }
            if !further.is_empty() && *inputs.microstructure() == Microstructure::PerRun =>
        {
            let name =
                |path: PathBuf| path.file_name().unwrap_or(path.as_os_str()).display().to_string();
            further.into_iter().map(name).collect()
        }
        _ => Vec::new(),
    })
}

/// The further images that runs are made on, each with its number. Their size is that of the first image.
///
/// # Errors
/// A case without geometry.
pub(super) fn further(inputs: &Inputs<'_>) -> Result<Vec<(usize, Scanned)>, WorkflowError> {
    let further = inputs.further_scanned()?;
    Ok((OWN + 1..).zip(further).collect())
}
