//! Work beyond one case and one process: studies with several calibrations, and jobs of a cluster.

mod base;
mod check;
mod compare;
mod contradiction;
mod file;
mod reference;
mod run;
mod shift;
mod slurm;
mod slurm_study;
mod status;
mod written_study;

pub use check::{PartCheck, StudyCheck};
pub use file::{StudyCase, StudyFile, StudyLaboratory, StudySetting};
pub use reference::Reference;
pub use run::Study;
pub use slurm::{SlurmError, SlurmJobs, Submitted};
pub use slurm_study::{StudyJob, StudyPart};
pub use status::{PartStatus, study_status};
pub(crate) use written_study::study_schema;
