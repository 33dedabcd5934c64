//! Sharing the work of a stage, or of a study, with other processes and with a cluster.

use std::path::{Path, PathBuf};

use clap::Args;
use models::{SlurmJobs, Stage, Study, Workflow};

use super::failure::{Failure, file_error};
use super::output::print_line;

/// How the work of a stage is shared with other processes.
#[derive(Args)]
pub(super) struct Sharing {
    /// Take part in the runs until none is left to begin; another process writes what they give
    #[arg(long, conflicts_with_all = ["slurm", "slurm_script"])]
    pub(super) share: bool,

    #[command(flatten)]
    pub(super) jobs: Jobs,
}

/// What jobs of a cluster are asked for.
#[derive(Args)]
pub(super) struct Jobs {
    /// Submit the work to Slurm: jobs that share DIR, each after those whose results it reads
    #[arg(long)]
    slurm: bool,

    /// Write the script of those jobs to FILE; without --slurm nothing is submitted
    #[arg(long, value_name = "FILE")]
    slurm_script: Option<PathBuf>,

    /// Jobs of the array that makes the runs
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

impl Jobs {
    /// Whether there are to be any.
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

    /// Writes a script and returns its path.
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

/// Writes the script of the jobs of a stage, and submits it if that is asked for.
pub(super) fn slurm(
    workflow: &Workflow<'_>,
    stage: &'static Stage,
    asked: &Jobs,
    replace: &[PathBuf],
) -> Result<(), Failure> {
    // what would fail on the cluster fails here; what is finished is not submitted
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
            "job {}: collects them into {} once those have ended, however they end",
            submitted.collecting,
            runs.display()
        ))?;
        print_line(format_args!("next: breccia status {}", workflow.dir().display()))?;
    }
    Ok(())
}

/// Writes the script of the jobs of a study, and submits what is left of it if that is asked for.
pub(super) fn slurm_study(
    study: &Study<'_>,
    file: &Path,
    set: &[String],
    asked: &Jobs,
    replace: &[PathBuf],
) -> Result<(), Failure> {
    // a case that is none, or a folder of another one, fails here
    let parts = study.prepare()?;
    let mut stages = parts.iter().flat_map(|part| &part.status.stages);
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
        for job in jobs.submit_study(&script, &parts)? {
            print_line(format_args!("job {}: {}", job.number, job.does))?;
        }
        print_line(format_args!("next: breccia status {}", study.dir().display()))?;
    }
    Ok(())
}
