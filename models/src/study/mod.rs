//! Beyond one process and one case.

mod slurm;

pub use slurm::{SlurmError, SlurmJobs, Submitted};
