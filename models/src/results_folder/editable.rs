//! Products that the user may edit. The stage that wrote an edited product counts as finished, and later stages use the
//! edited file.

use super::pattern::matches;

/// Names of editable products: labels and meshes. Later stages can use such an edited file without the other files of
/// the same stage.
const EDITABLE: [&str; 4] = ["labels.tif", "images/#-labels.tif", "mesh.msh", "meshes/#.msh"];

/// Whether the user may edit a file of this name.
pub(crate) fn is_editable(name: &str) -> bool {
    EDITABLE.iter().any(|pattern| matches(pattern, name))
}

/// Message about a stage that is not run again.
pub(crate) fn finished_before(edited: &[&str]) -> String {
    match edited {
        [] => "finished before, unchanged".to_owned(),
        // do not mention --replace here: it would discard the edit
        edited => format!("finished before; {} was edited and is used as it is", edited.join(", ")),
    }
}
