//! Coverage of intervals: the frequency with which the intervals contain a known truth, for several
//! forward models.

mod emulated;
mod study;

pub use emulated::{Emulated, with_ratios};
pub use study::{CoverageRow, CoverageStudy, KnownStiffness, Laboratory, Setting};
