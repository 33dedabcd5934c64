//! Output of a finished run, and the state of a results folder.

use std::path::Path;
use std::process::ExitCode;

use super::failure::Failure;
use super::output::print_line;
use crate::study::{PartStatus, study_status};
use crate::workflow::{self, StageStatus};
use crate::{JointWorkflow, Workflow, WorkflowError};

/// Prints the state of a results folder; exit code 3 if there is unfinished work.
pub(super) fn status(dir: &Path) -> Result<ExitCode, Failure> {
    let study_parts = match study_status(dir)? {
        Some(study_parts) => study_parts,
        None => vec![PartStatus { name: String::new(), stages: workflow::status(dir)? }],
    };
    for PartStatus { name, stages } in &study_parts {
        if !name.is_empty() {
            print_line(name)?;
        }
        for stage in stages {
            print_line(stage)?;
        }
    }
    let mut stages = study_parts.iter().flat_map(|part| &part.stages);
    Ok(if stages.all(StageStatus::is_done) { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

/// Runs all stages, and prints the results.
pub(super) fn run_all(workflow: &Workflow<'_>) -> Result<(), Failure> {
    workflow.run_all()?;
    print_results(workflow.dir(), &["summary.txt", "map.csv", "confirm.csv"])
}

/// Runs all stages of a case with several tests, and prints the results of all tests together.
pub(super) fn run_all_tests(mut workflow: JointWorkflow<'_>) -> Result<(), Failure> {
    workflow.run_all()?;
    print_results(workflow.dir(), &["summary.txt", "map.csv", "without_tests.csv"])
}

/// Prints the files `names` of a results folder, and the path of the report.
fn print_results(out: &Path, names: &[&str]) -> Result<(), Failure> {
    for name in names {
        let path = out.join(name);
        // imported runs cannot be confirmed
        if *name == "confirm.csv" && !path.exists() {
            continue;
        }
        let text = std::fs::read_to_string(&path)
            .map_err(|source| WorkflowError::Io { path: path.clone(), source })?;
        print_line(format_args!("{}:\n{text}", path.display()))?;
    }
    print_line(format_args!("report: {}", out.join("report.html").display()))
}
