//! The files of the results.

use std::path::Path;

/// The table of the specimens, measured or virtual.
pub(super) const SPECIMENS: &str = "experiments/specimens.csv";

/// Stages that may warn, in order; [`warnings_of`] names the file of each.
pub(super) const WARNING_STAGES: [&str; 6] =
    ["segment", "mesh", "experiments", "ensemble", "calibrate", "confirm"];

/// The file with the warnings of a stage, one a line; absent if there are none.
pub(super) fn warnings_of(stage: &str) -> String {
    format!("warnings/{stage}.txt")
}

/// Whether two paths lead to one file.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
