//! Candidate that is a different test (another rate, another specimen, other keys of the case). A small separate
//! ensemble determines its response.

use surrogate::FitReport;

use super::elsewhere::Elsewhere;
use super::present::{Present, at_draws, mean};
use crate::case::CandidateCase;
use crate::forward::fitted::Fitted;
use crate::forward::posterior_draws::Draw;
use crate::forward::specimen_stiffness::{knowing_stiffness, of_specimens};
use crate::forward::uncertainty::SharedError;
use crate::further_test::{Belief, FurtherTest};
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::runs::fidelity::error_of_all;
use crate::runs::made_on::MadeOn;
use crate::runs::unusable_runs::{RunOrigin, UnusableRuns};
use crate::stages::ensemble::Plan;

/// Computes the unfinished runs of the candidate's ensemble, and derives the test from all its runs. Returns the belief
/// before the test, which is `belief`, unless a parameter has another value in the test (see [`Elsewhere`]).
///
/// The shared error is the error of the surrogate of the candidate's runs. For the quantities that the case compares,
/// the errors of `[fidelity]` and of the discrepancy are added, because the candidate uses the same meshes and the same
/// model. A candidate with the specimen and the quantities of the present test can share its error: see
/// [`FurtherTest::alike`].
pub(super) fn test(
    task: &Task<'_>,
    present: &Present,
    belief: &Belief,
    case: &CandidateCase,
    number: usize,
) -> Result<(Belief, FurtherTest), WorkflowError> {
    let file = task.inputs.candidate(case)?;
    let test_task = task.with(task.inputs.of(&file));
    let mut plan = Plan::of(&test_task.inputs, usize::MAX)?;
    let quantities = file.case.compared_quantities();
    let runs = plan.make_cheap(&test_task);
    // record the keys before an error is returned: the error of a candidate depends on them too
    task.inputs.reads_with(&test_task.inputs);
    let runs = runs?;
    let failed = runs.failed().map(|(record, reason)| (record.id, reason));
    let unusable = UnusableRuns::of(runs.records.len(), failed, RunOrigin::of(&test_task.inputs));
    let usable = runs.usable().count();
    if usable < LEAST_RUNS {
        return Err(WorkflowError::Unusable(match unusable {
            Some(unusable) => unusable.too_few(LEAST_RUNS),
            None => format!("{usable} runs are too few: write runs = 30 in the candidate"),
        }));
    }
    let (data, _) = plan.learnt(&test_task.inputs, &quantities, &[runs])?;
    task.inputs.reads_with(&test_task.inputs);
    if let Some(unusable) = unusable {
        say("warning", &format!("the further test {:?}: {}", case.name, unusable.warning()));
    }
    let name = format!("next-test/candidate-{number}.csv");
    let table = data.to_csv().map_err(|e| WorkflowError::io(&task.path(&name), e))?;
    task.write(&name, table)?;
    let specimens = of_specimens(&task.inputs)?;
    let fit = Fitted::of(&data, &specimens, task.inputs.surrogate(), Vec::new())?;
    let data = knowing_stiffness(&data, &specimens)?.unwrap_or(data);
    // the stiffness ratio, if it is an input, will be known for further specimens too: use its mean over the runs
    let known_inputs: Vec<f64> =
        (present.prior.len()..data.inputs().len()).map(|i| mean_of(&data, i)).collect();
    let elsewhere = Elsewhere::read(&task.inputs, number, &present.draws)?;
    let at = elsewhere.as_ref().map(|elsewhere| elsewhere.draws(&present.draws));
    let at = at.as_deref().unwrap_or(&present.draws);
    let means = fit.pce.value(&[mean(at), known_inputs.clone()].concat())?;
    let discrepancy = &task.inputs.calibration().discrepancy;
    let shared = SharedError::of(&fit, discrepancy, &means)?;
    let mut shared = shared.total();
    add_error_of_meshes(task, data.outputs(), &mut shared)?;
    let scatter = |draw: &Draw| scatter(draw, present, case, &quantities);
    let mut draws = at_draws(&fit.pce, &known_inputs, at, &scatter)?;
    let mut belief = belief.clone();
    let mut alike = None;
    match elsewhere {
        Some(elsewhere) => {
            draws = elsewhere.moved(draws);
            belief = present
                .belief_elsewhere(&elsewhere)
                .map_err(|error| WorkflowError::Unusable(error.to_string()))?;
        }
        None if file.case.specimen == task.inputs.unrecorded().case.specimen => {
            alike = present.alike(&quantities)?;
        }
        None => {}
    }
    Ok((belief, FurtherTest { draws, shared, seen: Vec::new(), alike }))
}

/// Minimum number of runs from which derivatives can be estimated.
const LEAST_RUNS: usize = 4;

fn mean_of(data: &surrogate::Dataset, input: usize) -> f64 {
    data.rows().map(|(x, _)| x[input]).sum::<f64>() / data.len() as f64
}

/// Adds the error covariance of the corrections of `[fidelity]`, for the quantities to which the
/// corrections apply.
fn add_error_of_meshes(
    task: &Task<'_>,
    outputs: &[String],
    shared: &mut [Vec<f64>],
) -> Result<(), WorkflowError> {
    if task.inputs.file_if_there("fidelity.json").is_none() {
        return Ok(());
    }
    let reports: Vec<FitReport> = task.inputs.json("fidelity.json")?;
    let runs = surrogate::Dataset::read_csv(task.inputs.file("runs.csv")?)?;
    let Some(error) = error_of_all(&reports, &MadeOn::of(&runs))? else { return Ok(()) };
    let corrected = &reports[0].outputs;
    let index_of = |name: &String| corrected.iter().position(|output| output == name);
    for (row, a) in shared.iter_mut().zip(outputs) {
        for (entry, b) in row.iter_mut().zip(outputs) {
            if let (Some(a), Some(b)) = (index_of(a), index_of(b)) {
                *entry += error[a][b];
            }
        }
    }
    Ok(())
}

/// Covariance of the quantities between specimens. The candidate specifies the standard deviations; the default is the
/// standard deviation of the present test at this draw. The correlations are taken from the present test; quantities
/// that the present test lacks are uncorrelated.
fn scatter(
    draw: &Draw,
    present: &Present,
    case: &CandidateCase,
    quantities: &[Quantity],
) -> Vec<Vec<f64>> {
    let index_of = |quantity: &Quantity| {
        present.outputs.iter().position(|column| *column == quantity.column())
    };
    let sd = |quantity: &Quantity| match (case.scatter_percent.get(quantity), index_of(quantity)) {
        (Some(percent), _) => 0.01 * percent,
        (None, Some(at)) => draw.scatter[at][at].sqrt(),
        // unreachable: the check of the case requires one of the two values
        (None, None) => f64::NAN,
    };
    let correlation = |a: &Quantity, b: &Quantity| match (index_of(a), index_of(b)) {
        _ if a == b => 1.0,
        (Some(i), Some(j)) => draw.scatter[i][j] / (draw.scatter[i][i] * draw.scatter[j][j]).sqrt(),
        _ => 0.0,
    };
    let row = |a| quantities.iter().map(|b| sd(a) * sd(b) * correlation(a, b)).collect();
    quantities.iter().map(row).collect()
}
