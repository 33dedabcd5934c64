//! The files of the results.

use std::path::Path;

/// The table of the specimens, measured or virtual.
pub(super) const SPECIMENS: &str = "experiments/specimens.csv";

/// Whether two paths lead to one file.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
