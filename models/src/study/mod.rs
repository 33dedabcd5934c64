//! Beyond one process and one case: several calibrations and what they say together, jobs of a cluster.

mod base;
mod compare;
mod conclude;
mod contradiction;
mod file;
mod run;
mod shift;
mod slurm;
mod slurm_study;
mod status;

pub use file::{Reference, StudyCase, StudyFile, StudyLaboratory, StudySetting};
pub use run::Study;
pub use slurm::{SlurmError, SlurmJobs, Submitted};
pub use slurm_study::{StudyJob, StudyPart};
pub use status::{PartStatus, study_status};
