//! A single run of a program of the user, to try the program before the runs of the design.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::SystemTime;

use fem::{RunInput, RunStatus};
use ppl::Univariate;

use crate::case::CaseFile;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::run_key::RunKey;
use crate::pipeline::stage::Stage;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::runs::ensemble_runs::{NamedRuns, folder_of_runs};
use crate::runs::run_source::RequestedRuns;
use crate::runs::run_sources::source_of;
use crate::simulation::run_values::quantities;

/// Subfolder of the results with the folders of single runs.
const FOLDER: &str = "simulate";

/// Runs the program of a case once, at the medians of the priors, and prints the quantities. Each call makes a new run.
/// Returns the folder of the run.
///
/// # Errors
/// Fails if the case has no program, if the run fails, or if it has no quantities.
pub(super) fn simulate_outside(
    file: &CaseFile,
    dir: &Path,
    interrupt: &AtomicBool,
) -> Result<PathBuf, WorkflowError> {
    let folder = file.path.with_file_name("");
    let inputs = Inputs::new(file, &folder, Stage::that_writes);
    let source = source_of(&inputs)?;
    if source.parameter_points().is_some() {
        let message = "the runs of design.import are finished: there is no [simulator] to run";
        return Err(WorkflowError::Unusable(message.to_owned()));
    }
    let priors = inputs.priors()?;
    let names: Vec<String> = inputs.parameters()?.iter().map(ToString::to_string).collect();
    let values: Vec<f64> = priors.iter().map(|prior| prior.quantile(0.5)).collect();
    for (name, value) in names.iter().zip(&values) {
        say("simulate", &format!("{name} = {value}"));
    }
    // a new identity: the program may have changed although its files are the same
    let key = source.identified(RunKey::new(&inputs, &["prior"], &[]), &inputs);
    let key = key.with(&format!("{:?}\n", SystemTime::now()));
    let runs = [RunInput { id: 1, inputs: values }];
    let named = NamedRuns {
        folder: FOLDER,
        label: "run",
        key: &key,
        names: &names,
        runs: &runs,
        wait: true,
    };
    let task = Task::new(FOLDER, inputs, dir, 1, interrupt);
    let requested = RequestedRuns { task: &task, level: None, specimens: None, named };
    let records = source.records(&requested)?;
    if let RunStatus::Failed(reason) = &records[0].status {
        return Err(WorkflowError::Unusable(format!("the run failed: {reason}")));
    }
    let qoi = task.inputs.qoi();
    let computed = quantities(&records[0], qoi)
        .map_err(|reason| WorkflowError::Unusable(format!("the run is {reason}")))?;
    for (quantity, value) in qoi.quantities.iter().zip(computed) {
        say("simulate", &format!("{} = {value}", quantity.column()));
    }
    say("simulate", &format!("{:.1} s", records[0].seconds));
    Ok(folder_of_runs(dir, None, FOLDER, &key))
}
