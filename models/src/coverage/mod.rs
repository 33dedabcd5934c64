//! Coverage of intervals: the frequency with which the intervals contain a known truth, for several
//! forward models.
//!
//! 1. `mesh_ratio`: correction of runs on a cheap mesh in synthetic laboratories
//! 2. `table`: intervals of laboratories, and the table of their coverage
//! 3. `study`: calibration of many laboratories
//! 4. `emulated`: synthetic laboratories with one test
//! 5. `joint`: synthetic laboratories with several tests
//! 6. `next_tests`: synthetic laboratories that choose their next tests

#[cfg(test)]
mod closed_form;
mod emulated;
mod joint;
mod mesh_ratio;
mod next_tests;
mod study;
mod table;

pub use emulated::{Emulated, with_ratios};
pub use joint::EmulatedTests;
pub use mesh_ratio::MeshRatio;
pub use next_tests::{NextTests, ProgrammeStep, TestProgramme};
pub use study::{
    CoverageStudy, JointLaboratory, JointSetting, KnownStiffness, Laboratory, Setting,
};
pub use table::CoverageRow;
