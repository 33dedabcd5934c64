//! Products that the user may edit: the stage counts as done, and later stages use the edited file.

use super::pattern::matches;

/// Labels and meshes, which later stages read without what else the stage has written of them.
const EDITABLE: [&str; 4] = ["labels.tif", "images/#-labels.tif", "mesh.msh", "meshes/#.msh"];

/// Whether later stages use a file of this name as the user has edited it.
pub(super) fn is_editable(name: &str) -> bool {
    EDITABLE.iter().any(|pattern| matches(pattern, name))
}

/// What is said of a stage that is not run again.
pub(super) fn finished_before(edited: &[&str]) -> String {
    match edited {
        [] => "finished before, unchanged".to_owned(),
        // no command that gives up the edit is advised here
        edited => format!("finished before; {} was edited and is used as it is", edited.join(", ")),
    }
}
