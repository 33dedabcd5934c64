//! Do the intervals hold what they promise? Experiments with a known truth, calibrated by several
//! forward models side by side.

mod emulated;
mod study;

pub use emulated::Emulated;
pub use study::{CoverageRow, CoverageStudy, KnownStiffness, Laboratory, Setting};
