//! Beyond one process and one case: several calibrations and what they say together, jobs of a cluster.

mod compare;
mod file;
mod run;
mod slurm;

pub use file::{Reference, StudyCase, StudyFile, StudyLaboratory};
pub use run::{PartStatus, Study, study_status};
pub use slurm::{SlurmError, SlurmJobs, Submitted};
