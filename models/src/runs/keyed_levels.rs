//! The mesh levels of an ensemble with the identities of their runs.

use super::microstructures::Microstructures;
use super::simulation_key::with_made_meshes;
use crate::case_inputs::CaseInputs;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::run_key::RunKey;
use crate::results_folder::error::WorkflowError;
use crate::specimen::levels::Level;

/// Returns the mesh levels of a case, from the cheapest mesh to the mesh of the case; `key` identifies the runs on the
/// mesh of the case, and `specimens` are the specimens of the runs. The meshes of the cheaper levels are not files: their
/// runs also depend on everything from which a mesh is made. Adding a level does not change the identity of the runs of
/// other levels, except that only the cheapest level has derivatives.
///
/// # Errors
/// Fails for a specimen with wrong values.
pub(crate) fn keyed_levels<'a>(
    inputs: &'a Inputs<'_>,
    key: &RunKey,
    specimens: Option<&Microstructures>,
) -> Result<Vec<Level<'a>>, WorkflowError> {
    let mut levels = Level::all(inputs, key);
    let finest = levels.len() - 1;
    // the key of runs on packings has the specimen already
    let are_packings = specimens.is_some_and(|specimens| specimens.meshes() == 0);
    for (k, level) in levels.iter_mut().enumerate() {
        if k < finest && !are_packings {
            level.key = with_made_meshes(&level.key, inputs)?;
        }
        // the key `design` states whether the runs have derivatives, but not on which level
        if inputs.design().derivatives && !level.setup.derivatives {
            level.key = level.key.with("derivatives = false\n");
        }
    }
    Ok(levels)
}
