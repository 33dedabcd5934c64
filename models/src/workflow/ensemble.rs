//! Stage `ensemble`: the simulations that the surrogate learns from.

use std::borrow::Cow;

use fem::{RunInput, RunRecord, RunStatus, gmsh, write_curve};
use surrogate::Dataset;

use super::WorkflowError;
use super::files::write;
use super::packings::{Packings, SEED};
use super::runs::run_ensemble;
use super::simulator::{Simulator, simulated_qois};
use super::task::Task;
use crate::case::QoiCase;

/// What is known of a run beside its numbers; the seed is that of a packing of its own.
const NOTES: [&str; 3] = ["run", "seconds", SEED];

pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    inputs.check_steps()?;
    let prior = inputs.prior()?;
    let design = inputs.design();
    let points = design.method.sample(&prior, design.runs, design.seed)?;
    let runs: Vec<RunInput> =
        points.into_iter().enumerate().map(|(i, inputs)| RunInput { id: i + 1, inputs }).collect();
    let names: Vec<String> = prior.iter().map(|input| input.name.clone()).collect();
    let packings = Packings::of(inputs, runs.len())?;
    let records = match &packings {
        Some(packings) => run_ensemble(task, "ensemble", &names, &runs, &|run| {
            packings.simulator(run.id - 1).map(Cow::Owned)
        })?,
        None => {
            let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
            let simulator = Simulator::new(&inputs.setup(), mesh, inputs.parameters()?)?;
            run_ensemble(task, "ensemble", &names, &runs, &|_| Ok(Cow::Borrowed(&simulator)))?
        }
    };

    // how quantities are taken from curves is not part of what names the ensemble
    let qoi = inputs.qoi();
    let outputs = qoi.quantities.iter().map(|q| q.column().to_owned()).collect();
    let mut data = Dataset::new(prior, outputs, "breccia ensemble")?.with_notes(&NOTES)?;
    let mut failed = Vec::new();
    for record in &records {
        write_curve(task.product(&format!("curves/run-{:03}.csv", record.id))?, &record.curve)?;
        let (id, seconds) = (record.id.to_string(), format!("{:.3}", record.seconds));
        match quantities(record, qoi) {
            Ok(values) => {
                let seed = packings.as_ref().map(|p| p.seeds[record.id - 1].to_string());
                let seed = seed.unwrap_or_default();
                data.push_noted(&record.inputs, &values, &[&id, &seconds, &seed])?;
            }
            Err(reason) => {
                let values = record.inputs.iter().map(f64::to_string);
                failed.push(
                    [id].into_iter().chain(values).chain([seconds, reason]).collect::<Vec<_>>(),
                );
            }
        }
    }
    let path = task.product("runs.csv")?;
    write(&path, &data.to_csv().map_err(|e| WorkflowError::io(&path, e))?)?;
    let header =
        ["run"].into_iter().chain(names.iter().map(String::as_str)).chain(["seconds", "reason"]);
    task.write_csv("failed_runs.csv", header, failed)?;
    let (all, seconds) = (records.len(), records.iter().map(|r| r.seconds).sum::<f64>());
    Ok(format!("{} of {all} runs usable, {:.1} s a run", data.len(), seconds / all as f64))
}

/// The case's quantities of a run, or why it has none.
pub(super) fn quantities(record: &RunRecord, qoi: &QoiCase) -> Result<Vec<f64>, String> {
    match &record.status {
        RunStatus::Failed(reason) => Err(format!("failed: {reason}")),
        RunStatus::Finished => simulated_qois(&record.curve, qoi.slope_fraction)
            .map(|qois| qois.values(&qoi.quantities))
            .map_err(|error| format!("unusable: {error}")),
    }
}
