//! Names of files in a results folder.

use std::path::Path;

/// The table of the specimens, measured or virtual.
pub(crate) const SPECIMENS: &str = "experiments/specimens.csv";

/// Copy of the table of measured quantities.
pub(crate) const VALUES: &str = "experiments/values.csv";

/// Copy of the imported table of runs.
pub(crate) const IMPORTED: &str = "imported_runs.csv";

/// Folder of the inputs of a case that was detached from its study.
pub(crate) const INPUTS: &str = "inputs";

/// Stages that can issue warnings, in order; [`warnings_of`] returns the name of each stage's file.
pub(crate) const WARNING_STAGES: [&str; 7] =
    ["segment", "mesh", "experiments", "ensemble", "calibrate", "confirm", "validate"];

/// Name of the file with the warnings of a stage, one per line. The file does not exist if there are no warnings.
pub(crate) fn warnings_of(stage: &str) -> String {
    format!("warnings/{stage}.txt")
}

/// Whether two paths lead to the same file.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
