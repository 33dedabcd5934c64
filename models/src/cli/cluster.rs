//! Distribution of the work of a stage or a study to other processes and to a cluster.

use std::path::{Path, PathBuf};

use crate::study::SlurmJobs;
use crate::{Stage, Study, Workflow};
use clap::Args;

use super::failure::{Failure, file_error};
use super::output::print_line;

/// Options that share the work of a stage with other processes.
#[derive(Args)]
pub(super) struct Sharing {
    /// Compute runs until every run has been started; another process waits for the runs and collects the results
    #[arg(long, conflicts_with_all = ["slurm", "slurm_script"])]
    pub(super) share: bool,

    #[command(flatten)]
    pub(super) jobs: Jobs,
}

/// Options of the jobs of a cluster.
#[derive(Args)]
pub(super) struct Jobs {
    /// Submit the work to Slurm as jobs that share DIR; each job starts after the jobs whose results it reads
    #[arg(long)]
    slurm: bool,

    /// Write the script of the Slurm jobs to FILE; without --slurm the script is not submitted
    #[arg(long, value_name = "FILE")]
    slurm_script: Option<PathBuf>,

    /// Number of jobs in the array that computes the runs
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    tasks: u16,

    /// Processors per job, which is also the number of simultaneous runs per job
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    cpus: u16,

    /// Time limit of a job in the format of Slurm, such as 4:00:00
    #[arg(long, value_name = "TIME")]
    time: Option<String>,

    /// Memory of a job in the format of Slurm, such as 8G
    #[arg(long, value_name = "SIZE")]
    memory: Option<String>,

    /// Partition of the cluster
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,

    /// Any other option of sbatch, such as --sbatch=--account=rocks; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
}

impl Jobs {
    /// Whether jobs or their script were requested.
    pub(super) fn are_asked_for(&self) -> bool {
        self.slurm || self.slurm_script.is_some()
    }

    fn of(&self, results: &Path) -> Result<SlurmJobs, Failure> {
        Ok(SlurmJobs {
            program: std::env::current_exe().map_err(|e| file_error(Path::new("breccia"), e))?,
            results: absolute(results)?,
            tasks: self.tasks.into(),
            cpus: self.cpus.into(),
            time: self.time.clone(),
            memory: self.memory.clone(),
            partition: self.partition.clone(),
            options: self.sbatch.clone(),
        })
    }

    /// Writes the script of the jobs and returns its path.
    fn write(
        &self,
        jobs: &SlurmJobs,
        name: &str,
        text: &str,
        replace: &[PathBuf],
    ) -> Result<PathBuf, Failure> {
        let script = self.slurm_script.clone().unwrap_or_else(|| jobs.logs().join(name));
        jobs.write_script(&script, text, replace)?;
        print_line(format_args!("wrote {}", script.display()))?;
        if !self.slurm {
            print_line(format_args!("next: sbatch {}", script.display()))?;
        }
        Ok(script)
    }
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    Ok(std::path::absolute(path).map_err(|e| file_error(path, e))?)
}

/// Writes the script of the jobs of a stage, and submits the jobs if requested.
pub(super) fn slurm(
    workflow: &Workflow<'_>,
    stage: &'static Stage,
    asked: &Jobs,
    replace: &[PathBuf],
) -> Result<(), Failure> {
    // errors are reported here instead of on the cluster; a finished stage is not submitted
    if !workflow.rehearse(stage)? && asked.slurm {
        print_line("nothing is submitted")?;
        return Ok(());
    }
    let jobs = asked.of(workflow.dir())?;
    let script = asked.write(&jobs, "ensemble.sbatch", &jobs.script()?, replace)?;
    if asked.slurm {
        let submitted = SlurmJobs::submit(&script)?;
        let (tasks, cpus) = (jobs.tasks, jobs.cpus);
        let array = submitted.array;
        print_line(format_args!("job {array}: {tasks} tasks of {cpus} processors make the runs"))?;
        let runs = workflow.dir().join("runs.csv");
        print_line(format_args!(
            "job {}: collects the runs in {} when the tasks have ended, with or without errors",
            submitted.collecting,
            runs.display()
        ))?;
        print_line(format_args!("next: breccia status {}", workflow.dir().display()))?;
    }
    Ok(())
}

/// Writes the script of the jobs of a study, and submits its unfinished jobs if requested.
pub(super) fn slurm_study(
    study: &Study<'_>,
    file: &Path,
    set: &[String],
    asked: &Jobs,
    replace: &[PathBuf],
) -> Result<(), Failure> {
    // fails here if a case is invalid or a folder belongs to another case
    let study_parts = study.prepare()?;
    let mut stages = study_parts.iter().flat_map(|part| &part.status.stages);
    if asked.slurm
        && stages.all(|stage| stage.is_done())
        && study.dir().join("report.html").is_file()
    {
        print_line("nothing is submitted")?;
        return Ok(());
    }
    let jobs = asked.of(study.dir())?;
    let text = jobs.study_script(&absolute(file)?, set)?;
    let script = asked.write(&jobs, "study.sbatch", &text, replace)?;
    if asked.slurm {
        for job in jobs.submit_study(&script, &study_parts)? {
            print_line(format_args!("job {}: {}", job.number, job.does))?;
        }
        print_line(format_args!("next: breccia status {}", study.dir().display()))?;
    }
    Ok(())
}
