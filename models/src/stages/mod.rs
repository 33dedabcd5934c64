//! The stages of a case. A stage reads results of earlier stages, calls functions of the other modules, and writes its
//! products. The stages `segment` and `mesh` are files of the module `specimen`.
//!
//! 1. `experiments`, `sequential`, `ensemble`, `surrogate`, `calibrate`, `confirm`, `validate`: from specimens to predictions
//! 2. `next_test`, `report`, `verdict`: further tests, the report, and the verdict on each parameter
//! 3. `joint`: the stages of several tests together
//! 4. `table`: all stages in order

pub(crate) mod calibrate;
pub(crate) mod confirm;
pub(crate) mod ensemble;
pub(crate) mod experiments;
pub(crate) mod joint;
pub(crate) mod next_test;
pub(crate) mod report;
pub(crate) mod sequential;
pub(crate) mod surrogate;
pub(crate) mod table;
pub(crate) mod validate;
pub(crate) mod verdict;
