//! The stages of a case. A stage reads results of earlier stages, calls functions of the other modules, and writes its
//! products. `table` lists all stages in order; the stages `segment` and `mesh` are files of the module `specimen`.

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
