//! The identity of simulated runs: all keys of the case and all files that can change a simulation.

use crate::case_inputs::CaseInputs;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::run_key::RunKey;
use crate::results_folder::error::WorkflowError;
use crate::specimen::build::Scanned;
use crate::specimen::images;

/// Keys of the case that define a simulation on a given mesh.
const SIMULATION: [&str; 10] = [
    // the conditions of `test.kind` depend on the size of the block and its notch, also on an edited mesh
    "specimen.block_mm",
    "specimen.notch",
    "specimen.order",
    "specimen.homogenisation",
    "material",
    "interface",
    "phase_field",
    "test",
    "conditions",
    "solver",
];

/// Files of a segmented image from which a mesh is made.
const SEGMENTED: [&str; 4] = ["labels.tif", "solid.tif", "grains.csv", "segment.csv"];

/// Key of simulations that depend on `further` keys and on `files`, for example on files of meshes.
pub(crate) fn key_of_simulations(inputs: &Inputs<'_>, further: &[&str], files: &[&str]) -> RunKey {
    RunKey::new(inputs, &[&SIMULATION[..], further].concat(), files)
}

/// Adds to a key the specimen of the case, for runs on packings, which are meshed from their exact grains.
///
/// # Errors
/// Fails for a specimen with wrong values.
pub(crate) fn with_specimen(key: &RunKey, inputs: &Inputs<'_>) -> Result<RunKey, WorkflowError> {
    let file = inputs.geometry_file(&inputs.geometry()?);
    Ok(key.and(inputs, &["specimen"], &file.as_deref().into_iter().collect::<Vec<_>>()))
}

/// Adds to a key everything from which the stage `mesh` makes a mesh, for runs on another mesh of the same specimen: the
/// table `specimen`, the file of the geometry, and the segmented images. The file `mesh.msh` does not suffice: the user
/// may have edited it, and a key such as `specimen.elements_across` may change one mesh of a specimen and not another.
///
/// # Errors
/// Fails for a specimen with wrong values.
pub(crate) fn with_made_meshes(key: &RunKey, inputs: &Inputs<'_>) -> Result<RunKey, WorkflowError> {
    let geometry = inputs.geometry()?;
    let mut files: Vec<String> = inputs.geometry_file(&geometry).into_iter().collect();
    if Scanned::of(&geometry).is_some() {
        let numbers = images::FIRST..=images::count(inputs)?;
        let files_of = |image| SEGMENTED.map(|name| images::segmented_file(image, name));
        files.extend(numbers.flat_map(files_of));
    }
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    Ok(key.and(inputs, &["specimen"], &files))
}

#[cfg(test)]
mod tests;
