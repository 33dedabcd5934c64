//! Sharing the work of a stage with other processes, and with a cluster.

use std::path::{Path, PathBuf};

use clap::Args;
use models::{SlurmJobs, Stage, Workflow};

use super::failure::{Failure, file_error};

/// How the work of a stage is shared with other processes.
#[derive(Args)]
pub(super) struct Sharing {
    /// Take part in the runs until none is left to begin; another process writes what they give
    #[arg(long)]
    pub(super) share: bool,

    /// Submit the runs to Slurm: an array of jobs that share DIR, and one that collects after them
    #[arg(long, conflicts_with = "share")]
    pub(super) slurm: bool,

    /// Write the script of those jobs to FILE; without --slurm nothing is submitted
    #[arg(long, value_name = "FILE", conflicts_with = "share")]
    pub(super) slurm_script: Option<PathBuf>,

    /// Jobs of the array
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    tasks: u16,

    /// Processors of a job, and so many runs at the same time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    cpus: u16,

    /// Limit of time of a job, as Slurm writes it, such as 4:00:00
    #[arg(long, value_name = "TIME")]
    time: Option<String>,

    /// Memory of a job, as Slurm writes it, such as 8G
    #[arg(long, value_name = "SIZE")]
    memory: Option<String>,

    /// Partition of the cluster
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,

    /// Any other option of sbatch, such as --sbatch=--account=rocks; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
}

/// Writes the script of the jobs, and submits it if that is asked for.
pub(super) fn slurm(
    workflow: &Workflow<'_>,
    stage: &'static Stage,
    asked: &Sharing,
) -> Result<(), Failure> {
    // what would fail on the cluster fails here; what is finished is not submitted
    if !workflow.rehearse(stage)? && asked.slurm {
        println!("nothing is submitted");
        return Ok(());
    }
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| file_error(path, e));
    let jobs = SlurmJobs {
        program: std::env::current_exe().map_err(|e| file_error(Path::new("breccia"), e))?,
        results: absolute(workflow.dir())?,
        tasks: asked.tasks.into(),
        cpus: asked.cpus.into(),
        time: asked.time.clone(),
        memory: asked.memory.clone(),
        partition: asked.partition.clone(),
        options: asked.sbatch.clone(),
    };
    let logs = jobs.logs();
    std::fs::create_dir_all(&logs).map_err(|e| file_error(&logs, e))?;
    let script = asked.slurm_script.clone().unwrap_or_else(|| logs.join("ensemble.sbatch"));
    std::fs::write(&script, jobs.script()?).map_err(|e| file_error(&script, e))?;
    println!("wrote {}", script.display());
    if asked.slurm {
        let submitted = SlurmJobs::submit(&script)?;
        let (tasks, cpus) = (jobs.tasks, jobs.cpus);
        println!("job {}: {tasks} tasks of {cpus} processors make the runs", submitted.array);
        let runs = workflow.dir().join("runs.csv");
        println!(
            "job {}: collects them into {} once those have ended, however they end",
            submitted.collecting,
            runs.display()
        );
        println!("next: breccia status {}", workflow.dir().display());
    } else {
        println!("next: sbatch {}", script.display());
    }
    Ok(())
}
