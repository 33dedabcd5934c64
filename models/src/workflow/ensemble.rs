//! Stage `ensemble`: the simulations that the surrogate learns from.

use std::path::Path;

use fem::{RunInput, RunRecord, RunStatus, gmsh, write_curve};
use surrogate::Input;

use super::campaign::run_campaign;
use super::files::{csv_text, write};
use super::fingerprint::Fingerprint;
use super::simulation::{Simulator, simulated_qois};
use super::{Stage, Workflow, WorkflowError};
use crate::case::PriorCase;
use crate::csv_table::CsvTable;
use crate::error::InputError;
use crate::qoi::Qois;

/// What `runs.csv` calls a run whose quantities of interest can be used.
const FINISHED: &str = "finished";

pub(super) fn inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    Ok(campaign_inputs(w)?.part(&w.case().qoi))
}

/// What the simulations depend on; how quantities are taken from their curves is not part of it.
fn campaign_inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    Ok(w.simulation_inputs()?.part(&w.case().design))
}

pub(super) fn run(w: &Workflow) -> Result<String, WorkflowError> {
    let design = &w.case().design;
    let points = design.method.sample(&surrogate_inputs(w.prior()?)?, design.runs, design.seed)?;
    let runs: Vec<RunInput> =
        points.into_iter().enumerate().map(|(i, inputs)| RunInput { id: i + 1, inputs }).collect();
    let mesh = gmsh::read(w.path("mesh.msh"), &gmsh::GmshNames::default())?;
    let simulator = Simulator::new(&w.file, mesh)?;
    let records =
        run_campaign(w, "ensemble", "runs", campaign_inputs(w)?, &runs, &|run, observer| {
            simulator.run(&run.inputs, observer)
        })?;

    let mut usable = 0;
    let mut rows = Vec::new();
    for record in &records {
        write_curve(w.path(&format!("curves/run-{:03}.csv", record.id)), &record.curve)?;
        let (qois, status) = outcome(w, record);
        usable += usize::from(qois.is_some());
        rows.push(row(record, qois, status));
    }
    let header = ["run"]
        .into_iter()
        .chain(PriorCase::NAMES)
        .chain(Qois::NAMES)
        .chain(["status", "seconds"])
        .collect::<Vec<_>>()
        .join(",");
    write(&w.path(Stage::Ensemble.product()), &csv_text(&header, rows))?;
    let (all, seconds) = (records.len(), records.iter().map(|r| r.seconds).sum::<f64>());
    Ok(format!("{usable} of {all} runs usable, {:.1} s a run", seconds / all as f64))
}

/// The prior box as the surrogate's inputs.
pub(super) fn surrogate_inputs(prior: &PriorCase) -> Result<Vec<Input>, WorkflowError> {
    let bounds = PriorCase::NAMES.into_iter().zip(prior.bounds());
    Ok(bounds
        .map(|(name, [lower, upper])| Input::new(name, lower, upper))
        .collect::<Result<_, _>>()?)
}

/// The quantities of a run, or why it has none.
fn outcome(w: &Workflow, record: &RunRecord) -> (Option<Qois>, String) {
    match &record.status {
        RunStatus::Failed(reason) => (None, format!("failed: {reason}")),
        RunStatus::Finished => match simulated_qois(&record.curve, w.case()) {
            Ok(qois) => (Some(qois), FINISHED.to_owned()),
            Err(error) => (None, format!("unusable: {error}")),
        },
    }
}

fn row(record: &RunRecord, qois: Option<Qois>, status: String) -> Vec<String> {
    let qois = match qois {
        Some(qois) => qois.to_array().map(|q| q.to_string()).to_vec(),
        None => vec![String::new(); Qois::NAMES.len()],
    };
    [format!("{}", record.id)]
        .into_iter()
        .chain(record.inputs.iter().map(f64::to_string))
        .chain(qois)
        .chain([status, format!("{:.3}", record.seconds)])
        .collect()
}

/// Parameters and quantities of one run.
type Sample = ([f64; 3], [f64; 3]);

/// Parameters and quantities of the usable runs of a `runs.csv`.
pub(super) fn read_runs(path: &Path) -> Result<Vec<Sample>, InputError> {
    let columns: Vec<&str> =
        PriorCase::NAMES.into_iter().chain(Qois::NAMES).chain(["status"]).collect();
    let table = CsvTable::read(path, &columns)?;
    let mut runs = Vec::new();
    for row in table.rows().filter(|row| row.text("status") == FINISHED) {
        let (mut x, mut y) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            x[i] = row.number(PriorCase::NAMES[i])?;
            y[i] = row.number(Qois::NAMES[i])?;
        }
        runs.push((x, y));
    }
    Ok(runs)
}
