//! Stage `confirm`: simulations at the mode and at posterior draws, against the experiments.

use std::path::Path;

use fem::{RunInput, RunRecord, RunStatus, gmsh, write_curve};

use super::campaign::run_campaign;
use super::files::{csv_text, write};
use super::fingerprint::Fingerprint;
use super::laboratory::read_experiments;
use super::simulation::{Simulator, simulated_qois};
use super::{Stage, Workflow, WorkflowError};
use crate::case::PriorCase;
use crate::csv_table::CsvTable;
use crate::error::InputError;
use crate::progress::say;
use crate::qoi::{Qois, mean_qois};

pub(super) fn inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    Ok(campaign_inputs(w)?
        .file(&w.needed("experiments.csv", Stage::Laboratory)?)?
        .part(&w.case().qoi))
}

fn campaign_inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    Ok(w.simulation_inputs()?
        .file(&w.needed("map.csv", Stage::Calibrate)?)?
        .file(&w.needed("posterior.csv", Stage::Calibrate)?)?
        .part(&w.case().confirm))
}

pub(super) fn run(w: &Workflow) -> Result<String, WorkflowError> {
    let mut points = vec![read_map(&w.path("map.csv"))?];
    points.extend(read_draws(&w.path("posterior.csv"), w.case().confirm.draws)?);
    let names: Vec<String> = (0..points.len())
        .map(|i| if i == 0 { "map".to_owned() } else { format!("draw-{i}") })
        .collect();
    let runs: Vec<RunInput> = points
        .iter()
        .enumerate()
        .map(|(id, point)| RunInput { id: id + 1, inputs: point.to_vec() })
        .collect();
    let mesh = gmsh::read(w.path("mesh.msh"), &gmsh::GmshNames::default())?;
    let simulator = Simulator::new(&w.file, mesh)?;
    let job =
        |run: &RunInput, observer: &mut dyn fem::Observer| simulator.run(&run.inputs, observer);
    let records = run_campaign(w, "confirm", "confirm", campaign_inputs(w)?, &runs, &job)?;

    let mut rows = Vec::new();
    for (record, name) in records.iter().zip(&names) {
        write_curve(w.path(&format!("curves/{name}.csv")), &record.curve)?;
        let qois = confirmed(w, record);
        if let Err(reason) = &qois {
            say(
                "note",
                &format!("the simulation at {name} has no quantities of interest: {reason}"),
            );
        }
        let qois = qois.map_or_else(
            |_| vec![String::new(); 3],
            |q| q.to_array().map(|x| x.to_string()).to_vec(),
        );
        rows.push(
            [name.clone()].into_iter().chain(record.inputs.iter().map(f64::to_string)).chain(qois),
        );
    }
    let header = format!("run,{},{}", PriorCase::NAMES.join(","), Qois::NAMES.join(","));
    write(&w.path("confirm_runs.csv"), &csv_text(&header, rows))?;

    let map = confirmed(w, &records[0]).map_err(|reason| {
        WorkflowError::Unusable(format!("the simulation at the mode: {reason}"))
    })?;
    let experiments = mean_qois(&read_experiments(w)?).to_array();
    let mut worst = 0.0_f64;
    let rows = (0..3).map(|i| {
        let (mean, simulated) = (experiments[i], map.to_array()[i]);
        let error = 100.0 * (simulated / mean - 1.0).abs();
        worst = worst.max(error);
        [Qois::NAMES[i].to_owned(), mean.to_string(), simulated.to_string(), error.to_string()]
    });
    let header = "qoi,experiment_mean,map_simulation,percent_error";
    write(&w.path(Stage::Confirm.product()), &csv_text(header, rows.collect::<Vec<_>>()))?;
    Ok(format!("the simulation at the mode is within {worst:.2} % of the experimental means"))
}

fn confirmed(w: &Workflow, record: &RunRecord) -> Result<Qois, String> {
    match &record.status {
        RunStatus::Failed(reason) => Err(reason.clone()),
        RunStatus::Finished => simulated_qois(&record.curve, w.case()).map_err(|e| e.to_string()),
    }
}

fn read_map(path: &Path) -> Result<[f64; 3], InputError> {
    let table = CsvTable::read(path, &["parameter", "map"])?;
    let mut map = [f64::NAN; 3];
    for (value, name) in map.iter_mut().zip(PriorCase::NAMES) {
        let row = table.rows().find(|row| row.text("parameter") == name).ok_or_else(|| {
            InputError::new(path, name, "", "has no line", "Run breccia calibrate again.")
        })?;
        *value = row.number("map")?;
    }
    Ok(map)
}

/// `n` draws spread evenly over all chains.
fn read_draws(path: &Path, n: usize) -> Result<Vec<[f64; 3]>, InputError> {
    let table = CsvTable::read(path, &PriorCase::NAMES)?;
    let rows: Vec<_> = table.rows().collect();
    let mut draws = Vec::new();
    for k in 0..n.min(rows.len()) {
        let row = rows[(2 * k + 1) * rows.len() / (2 * n)];
        let [young, toughness, viscosity] = PriorCase::NAMES.map(|name| row.number(name));
        draws.push([young?, toughness?, viscosity?]);
    }
    Ok(draws)
}
