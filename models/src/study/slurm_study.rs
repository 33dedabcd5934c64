//! Runs a study as jobs of a Slurm cluster. Each laboratory is one job. Each case has a job for its mesh, an array for
//! its runs, and a job for all other stages. Each job starts after the jobs whose results it reads.

use std::path::Path;

use super::slurm::{SlurmError, SlurmJobs, plain, sbatch};
use super::status::PartStatus;

/// A laboratory or a case of a study, and the state of its stages.
#[derive(Clone, Debug)]
pub struct StudyPart {
    /// Folder of the part within the folder of the study, and the state of its stages.
    pub status: PartStatus,
    /// `None` for a laboratory. For a case, the folder of the laboratory that provides its specimens, or `Some(None)`
    /// if the case uses no laboratory.
    pub case: Option<Option<String>>,
}

/// A submitted job of a study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StudyJob {
    /// Number of the job.
    pub number: String,
    /// Description of the work of the job.
    pub does: String,
}

impl SlurmJobs {
    /// Returns the script of all jobs of a study. The arguments of the script select the work of a job; without
    /// arguments, the script runs the whole study.
    ///
    /// # Errors
    /// [`SlurmError::Name`] if a path, key or option has characters that the script cannot contain.
    pub fn study_script(&self, study: &Path, set: &[String]) -> Result<String, SlurmError> {
        let [program, results] = [&self.program, &self.results].map(|path| plain(path));
        let (program, results, study) = (program?, results?, plain(study)?);
        let options = self.options(&[], "%x-%j")?;
        let mut keys = String::new();
        for key in set {
            if key.contains(['\'', '\n', '\\']) {
                return Err(SlurmError::Name(key.clone()));
            }
            keys += &format!(" --set '{key}'");
        }
        let cpus = self.cpus.max(1);
        Ok(format!(
            r#"#!/bin/bash
# Jobs compute the parts of a study in one folder. Finished results are never made again. State of the study:
# breccia status '{results}'
{options}
program='{program}'
results='{results}'
threads="${{SLURM_CPUS_PER_TASK:-{cpus}}}"
study=("$program" study '{study}' --out "$results" --threads "$threads"{keys})

# exec: signals reach the program
case "${{1:-}}" in
mesh) exec "${{study[@]}}" --only "$2" --until mesh ;;
runs) exec "$program" ensemble --out "$results/$2" --threads "$threads" --share ;;
part) exec "${{study[@]}}" --only "$2" ;;
*) exec "${{study[@]}}" ;;
esac
"#
        ))
    }

    /// Submits the unfinished work of each part, and a job that compares the cases after all other jobs have ended,
    /// with or without errors.
    ///
    /// # Errors
    /// [`SlurmError::NoSlurm`] if `sbatch` cannot be started, [`SlurmError::Refused`] if Slurm rejects a job.
    pub fn submit_study(
        &self,
        script: &Path,
        study_parts: &[StudyPart],
    ) -> Result<Vec<StudyJob>, SlurmError> {
        let mut jobs: Vec<StudyJob> = Vec::new();
        // folder of each part, and the number of the last job submitted for the part
        let mut last: Vec<(&str, String)> = Vec::new();
        for StudyPart { status, case } in study_parts {
            let name = status.name.as_str();
            let done = |stage: &str| status.stages.iter().any(|s| s.stage == stage && s.is_done());
            if status.stages.iter().all(|stage| stage.is_done()) {
                continue;
            }
            let mut submit = |what: &'static str, after: &[&str], array: bool, part: &[&str]| {
                let job_name = format!("--job-name=breccia-{}-{}", name.replace('/', "-"), part[0]);
                let mut options = vec![job_name];
                if !after.is_empty() {
                    options.push(format!("--dependency=afterany:{}", after.join(":")));
                }
                if array {
                    options.push(format!("--array=0-{}", self.tasks.max(1) - 1));
                }
                let options: Vec<&str> = options.iter().map(String::as_str).collect();
                let number = sbatch("job", &options, script, part)?;
                jobs.push(StudyJob { number: number.clone(), does: format!("{name}: {what}") });
                Ok::<String, SlurmError>(number)
            };
            let Some(laboratory) = case else {
                last.push((name, submit("specimens", &[], false, &["part", name])?));
                continue;
            };
            let mut after = Vec::new();
            if !done("ensemble") {
                let mesh = match done("mesh") {
                    true => None,
                    false => Some(submit("mesh", &[], false, &["mesh", name])?),
                };
                let mesh: Vec<&str> = mesh.iter().map(String::as_str).collect();
                after.push(submit("runs", &mesh, true, &["runs", name])?);
            }
            let tested = laboratory
                .as_ref()
                .and_then(|l| last.iter().find(|(laboratory_name, _)| laboratory_name == l));
            after.extend(tested.map(|(_, number)| number.clone()));
            let after: Vec<&str> = after.iter().map(String::as_str).collect();
            last.push((name, submit("calibration", &after, false, &["part", name])?));
        }
        let ends: Vec<&str> = last.iter().map(|(_, number)| number.as_str()).collect();
        let mut options = vec!["--job-name=breccia-study".to_owned()];
        if !ends.is_empty() {
            options.push(format!("--dependency=afterany:{}", ends.join(":")));
        }
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        let number = sbatch("job", &options, script, &["all"])?;
        jobs.push(StudyJob {
            number,
            does: "missing results, and the comparison of all cases".to_owned(),
        });
        Ok(jobs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_says_what_each_job_does() {
        let jobs = SlurmJobs {
            program: "/opt/breccia".into(),
            results: "/scratch/study".into(),
            tasks: 4,
            cpus: 2,
            time: Some("1:00:00".into()),
            memory: None,
            partition: None,
            options: Vec::new(),
        };
        let set = ["qoi.quantities=[\"slope\"]".to_owned()];
        let script = jobs.study_script(Path::new("/home/me/study.toml"), &set).unwrap();
        for part in [
            "#SBATCH --cpus-per-task=2\n",
            "#SBATCH --time=1:00:00\n",
            "#SBATCH --output=\"/scratch/study/slurm/%x-%j.log\"\n",
            "study '/home/me/study.toml' --out \"$results\"",
            "--set 'qoi.quantities=[\"slope\"]')\n",
        ] {
            assert!(script.contains(part), "{part} is not in {script}");
        }
        assert!(!script.contains("--array"), "{script}");
        let odd = ["specimen.image.stack=\"it's\"".to_owned()];
        assert!(jobs.study_script(Path::new("/s.toml"), &odd).is_err());
    }
}
