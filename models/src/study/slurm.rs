//! Runs an ensemble as jobs of a Slurm cluster: an array of jobs that run the program and share the results folder, and
//! a subsequent job that collects the results of the runs.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::workflow::{ProductFolder, WorkflowError};

/// Settings of the jobs, and the resources that each job requests.
#[derive(Clone, Debug)]
pub struct SlurmJobs {
    /// Path of the program `breccia` on all machines.
    pub program: PathBuf,
    /// Absolute path of the results folder, which must be the same on all machines.
    pub results: PathBuf,
    /// Number of tasks of the array.
    pub tasks: usize,
    /// Number of processors of each task, which is also the number of its simultaneous runs.
    pub cpus: usize,
    /// Time limit in the format of Slurm (`4:00:00`).
    pub time: Option<String>,
    /// Memory of a task in the format of Slurm (`8G`).
    pub memory: Option<String>,
    /// Partition of the cluster.
    pub partition: Option<String>,
    /// Further options of sbatch.
    pub options: Vec<String>,
}

/// Numbers of the submitted jobs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// Number of the array that computes the runs.
    pub array: String,
    /// Number of the job that collects the results of the runs.
    pub collecting: String,
}

/// Error that prevents the submission of jobs.
#[derive(Debug, thiserror::Error)]
pub enum SlurmError {
    /// A path or an option has characters that a script cannot contain.
    #[error(
        "{0:?} has a line break or a quote, which a script for Slurm cannot contain; use another name"
    )]
    Name(String),
    /// `sbatch` cannot be started on this machine.
    #[error(
        "sbatch cannot be started ({0}); submit from a machine of the cluster, or write the script with \
         --slurm-script FILE and submit it there"
    )]
    NoSlurm(io::Error),
    /// Slurm rejects a job.
    #[error("sbatch refuses the {job}: {said}")]
    Refused {
        /// Name of the job.
        job: &'static str,
        /// Error message of Slurm.
        said: String,
    },
}

impl SlurmJobs {
    /// Writes a script, and creates the folder of the logs.
    ///
    /// # Errors
    /// If a file of the user has the path of the script and is not in `replace`, or if the script cannot be written.
    pub fn write_script(
        &self,
        script: &Path,
        text: &str,
        replace: &[PathBuf],
    ) -> Result<(), WorkflowError> {
        let logs = self.logs();
        std::fs::create_dir_all(&logs)
            .map_err(|source| WorkflowError::Io { path: logs.clone(), source })?;
        let failed = |source| WorkflowError::Io { path: script.to_owned(), source };
        let script = std::path::absolute(script).map_err(failed)?;
        let name = script.strip_prefix(&self.results).unwrap_or(&script);
        let folder = ProductFolder::new(&self.results, replace);
        folder.write(&name.to_string_lossy(), "--slurm-script", text.as_bytes()).map(drop)
    }

    /// Folder in which the jobs write their logs.
    pub fn logs(&self) -> PathBuf {
        self.results.join("slurm")
    }

    /// Returns the `#SBATCH` lines of a script: the options `job_options`, and the options that all scripts have. `log` is the
    /// name pattern of the log files.
    pub(super) fn options(&self, job_options: &[String], log: &str) -> Result<String, SlurmError> {
        let logs = plain(&self.logs())?;
        let name = self.results.file_name().map_or("results".into(), |name| name.to_string_lossy());
        // options within a script end at a space
        let name: String = name.chars().map(|c| if c.is_whitespace() { '-' } else { c }).collect();
        let asked = [("time", &self.time), ("mem", &self.memory), ("partition", &self.partition)]
            .into_iter()
            .filter_map(|(key, value)| Some(format!("--{key}={}", value.as_deref()?)))
            .chain(self.options.iter().cloned());
        let mut options = vec![format!("--job-name=breccia-{name}")];
        options.extend_from_slice(job_options);
        options.extend([
            "--ntasks=1".to_owned(),
            format!("--cpus-per-task={}", self.cpus.max(1)),
            // Slurm sends SIGTERM one minute before the time limit, and when the job is cancelled; the program then
            // saves the finished results
            "--signal=B:TERM@60".to_owned(),
            "--requeue".to_owned(),
            "--open-mode=append".to_owned(),
            format!("--output=\"{logs}/{log}.log\""),
        ]);
        for option in asked {
            options.push(plain(Path::new(&option))?);
        }
        Ok(options.iter().map(|option| format!("#SBATCH {option}\n")).collect())
    }

    /// Returns the script of all jobs. If it is submitted by hand, it has the same effect as [`SlurmJobs::submit`].
    ///
    /// # Errors
    /// [`SlurmError::Name`] if a path or an option has characters that the script cannot contain.
    pub fn script(&self) -> Result<String, SlurmError> {
        let [program, results] = [&self.program, &self.results].map(|path| plain(path));
        let (program, results) = (program?, results?);
        let array = format!("--array=0-{}", self.tasks.max(1) - 1);
        let options = self.options(&[array], "%A_%a")?;
        let cpus = self.cpus.max(1);
        Ok(format!(
            r#"#!/bin/bash
# An array of jobs computes the runs of an ensemble in one folder. When the array has ended, with or without errors,
# a job collects the runs in runs.csv. Submit this script as often as you like: finished runs are never made again.
# State of the runs:  breccia status '{results}'
{options}
program='{program}'
results='{results}'
ensemble=("$program" ensemble --out "$results" --threads "${{SLURM_CPUS_PER_TASK:-{cpus}}}")

# exec: signals reach the program
if [ "${{1:-}}" = collect ] || [ -z "${{SLURM_ARRAY_JOB_ID:-}}" ]; then
    exec "${{ensemble[@]}}"
fi
# submitted by hand: the first task submits the collecting job, or collects the runs itself if it must not submit jobs
if [ "${{1:-}}" != worker ] && [ "$SLURM_ARRAY_TASK_ID" = 0 ] && [ "${{SLURM_RESTART_COUNT:-0}}" = 0 ]; then
    sbatch --array=0 --dependency="afterany:$SLURM_ARRAY_JOB_ID" "$0" collect || exec "${{ensemble[@]}}"
fi
exec "${{ensemble[@]}}" --share
"#
        ))
    }

    /// Submits a script, and a collecting job that starts after it.
    ///
    /// # Errors
    /// [`SlurmError::NoSlurm`] if `sbatch` cannot be started, [`SlurmError::Refused`] if Slurm rejects a job.
    pub fn submit(script: &Path) -> Result<Submitted, SlurmError> {
        let array = sbatch("array of jobs", &[], script, &["worker"])?;
        let after = format!("--dependency=afterany:{array}");
        let collecting = sbatch("collecting job", &["--array=0", &after], script, &["collect"])?;
        Ok(Submitted { array, collecting })
    }
}

/// Submits a job and returns its number.
pub(super) fn sbatch(
    job: &'static str,
    options: &[&str],
    script: &Path,
    part: &[&str],
) -> Result<String, SlurmError> {
    let output = Command::new("sbatch")
        .arg("--parsable")
        .args(options)
        .arg(script)
        .args(part)
        .output()
        .map_err(SlurmError::NoSlurm)?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if !output.status.success() {
        return Err(SlurmError::Refused { job, said: text(&output.stderr) });
    }
    // with several clusters, the output is number;cluster
    let said = text(&output.stdout);
    Ok(said.split(';').next().unwrap_or_default().to_owned())
}

/// Returns a path as text, if the text can be put in quotes in a script and in an option.
pub(super) fn plain(path: &Path) -> Result<String, SlurmError> {
    let text = path.to_string_lossy().into_owned();
    match text.contains(['\'', '"', '\n', '\\']) {
        true => Err(SlurmError::Name(text)),
        false => Ok(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_asks_for_what_is_wanted_and_refuses_what_it_cannot_hold() {
        let jobs = SlurmJobs {
            program: "/opt/breccia/bin/breccia".into(),
            results: "/scratch/my results".into(),
            tasks: 8,
            cpus: 4,
            time: Some("4:00:00".into()),
            memory: None,
            partition: Some("short".into()),
            options: vec!["--account=rocks".into()],
        };
        let script = jobs.script().unwrap();
        for part in [
            "#SBATCH --array=0-7\n",
            "#SBATCH --cpus-per-task=4\n",
            "#SBATCH --time=4:00:00\n",
            "#SBATCH --partition=short\n",
            "#SBATCH --account=rocks\n",
            "#SBATCH --job-name=breccia-my-results\n",
            "#SBATCH --output=\"/scratch/my results/slurm/%A_%a.log\"\n",
            "results='/scratch/my results'\n",
        ] {
            assert!(script.contains(part), "{part} is not in {script}");
        }
        assert!(!script.contains("--mem"), "{script}");
        let odd = SlurmJobs { results: "/scratch/it's".into(), ..jobs };
        assert!(odd.script().unwrap_err().to_string().contains("it's"));
    }
}
