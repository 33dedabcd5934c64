//! Images of several specimens: names of the files that the stages `segment` and `mesh` write for each image.
//!
//! Images are numbered from 1. Image 1 is the image that the case names in `specimen.image.stack` or `labels`; the
//! files of image 1 have the same names as in a case with a single image.

use std::path::PathBuf;

use super::build::Scanned;
use super::image_inputs;
use crate::case::{Microstructure, SpecimenGeometry};
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;

/// Number of the image that the case names in `specimen.image`; further images have larger numbers.
pub(crate) const FIRST: usize = 1;

/// Name of a file that the stage `segment` writes for an image.
pub(crate) fn segmented_file(image: usize, name: &str) -> String {
    if image == FIRST { name.to_owned() } else { format!("images/{image}-{name}") }
}

/// Name of a file that the stage `mesh` writes for an image; `ending` is `msh` or `csv`.
pub(crate) fn mesh_file(image: usize, ending: &str) -> String {
    if image == FIRST { format!("mesh.{ending}") } else { format!("meshes/{image}.{ending}") }
}

/// Number of images on which the runs of the design are made; 1 if there are no further images.
///
/// # Errors
/// Fails for a case without geometry.
pub(crate) fn count(inputs: &Inputs<'_>) -> Result<usize, WorkflowError> {
    Ok(FIRST + names(inputs)?.len())
}

/// File names of the further images on which runs are made (image 2 and following).
///
/// # Errors
/// Fails for a case without geometry.
pub(crate) fn names(inputs: &Inputs<'_>) -> Result<Vec<String>, WorkflowError> {
    Ok(match inputs.geometry()? {
        // read `microstructure` only if there are further images: reading a key registers a dependency
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

/// Returns the further images on which runs are made, with their numbers. Their specimens get the size of the first
/// specimen.
///
/// # Errors
/// Fails for a case without geometry.
pub(crate) fn further(inputs: &Inputs<'_>) -> Result<Vec<(usize, Scanned)>, WorkflowError> {
    let further = image_inputs::further_scanned(inputs)?;
    Ok((FIRST + 1..).zip(further).collect())
}
