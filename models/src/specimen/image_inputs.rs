//! Images of specimens as inputs of a stage; every image is recorded.

use std::path::{Path, PathBuf};

use super::build::{Scanned, Source};
use crate::case::{ImageCase, Microstructure, SpecimenGeometry};
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;

/// Returns the image to be segmented, if the grains come from an image.
pub(crate) fn scanned(inputs: &Inputs<'_>) -> Result<Option<Scanned>, WorkflowError> {
    for key in ["image", "scan", "grains", "radius_mm", "height_mm"] {
        inputs.reads(&format!("specimen.{key}"));
    }
    let scanned = Scanned::of(&inputs.unrecorded().geometry()?).map(|(scanned, _)| scanned);
    if let Some(path) = scanned.as_ref().and_then(|scanned| scanned.source.path()) {
        inputs.reads_image(path);
    }
    if let Some(mask) = scanned.as_ref().and_then(|s| s.segmentation.region.mask.as_ref()) {
        inputs.reads_image(mask);
    }
    Ok(scanned)
}

/// Images of the further specimens of the design. These images are read and segmented with the settings of the
/// first image.
pub(crate) fn further_scanned(inputs: &Inputs<'_>) -> Result<Vec<Scanned>, WorkflowError> {
    let Some(first) = scanned(inputs)? else { return Ok(Vec::new()) };
    let geometry = inputs.unrecorded().geometry()?;
    let SpecimenGeometry::Image { labels, further, options, .. } = geometry else {
        return Ok(Vec::new());
    };
    if further.is_empty() || *inputs.microstructure() == Microstructure::One {
        return Ok(Vec::new());
    }
    let further_image = |path: PathBuf| {
        inputs.reads_image(&path);
        let source = Source::in_file(path, options.clone(), labels.clone());
        Scanned { source, segmentation: first.segmentation.clone(), size_mm: first.size_mm }
    };
    Ok(further.into_iter().map(further_image).collect())
}

/// Creates an error about the image of a further specimen.
pub(crate) fn refused_image(
    inputs: &Inputs<'_>,
    path: &Path,
    problem: &str,
    help: &str,
) -> WorkflowError {
    let name = path.display().to_string();
    inputs.unrecorded().error("specimen.image.further_stacks", name, problem, help).into()
}

/// Settings for reading and segmenting images of specimens.
pub(crate) fn image_settings(inputs: &Inputs<'_>) -> ImageCase {
    inputs.reads("specimen.image");
    inputs.unrecorded().case.specimen.image.clone().unwrap_or_default()
}
