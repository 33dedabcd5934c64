//! The simulation at the mode: quantities and damage.

use surrogate::Dataset;

use super::super::super::WorkflowError;
use super::super::super::inputs::Inputs;
use crate::predicted_curve::QUANTILES;
use crate::qoi::Quantity;
use crate::report::{DamageState, PredictedBand, Qoi};
use crate::table::CsvTable;

/// The quantities of interest in the experiments, the ensemble, new specimens and the simulation at the mode.
pub(super) fn qois(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    data: &Dataset,
) -> Result<Vec<Qoi>, WorkflowError> {
    let files = ["confirm.csv", "experiments.csv", "predictive.csv"];
    let [confirm, experiments, predictive] = files.map(|file| inputs.file(file));
    let (confirm, experiments, predictive) = (confirm?, experiments?, predictive?);
    let confirm = CsvTable::read(
        &confirm,
        &["qoi", "map_simulation", "percent_error", "mesh_error_percent"],
    )?;
    let columns: Vec<&str> = quantities.iter().map(|quantity| quantity.column()).collect();
    let experiments = CsvTable::read(&experiments, &columns)?;
    let predictive = CsvTable::read(&predictive, &columns)?;
    let mut qois = Vec::new();
    for (m, quantity) in quantities.iter().enumerate() {
        let name = quantity.column();
        let row = confirm.named("qoi", name)?;
        qois.push(Qoi {
            label: quantity.label().to_owned(),
            experiments: experiments.rows().map(|r| r.number(name)).collect::<Result<_, _>>()?,
            ensemble: data.rows().map(|(_, y)| y[m]).collect(),
            // a draw that could not be predicted is no number
            predictive: predictive.rows().filter_map(|r| r.number(name).ok()).collect(),
            map: row.number("map_simulation")?,
            percent_error: row.number("percent_error")?,
            mesh_error_percent: row.text("mesh_error_percent").parse().ok(),
            sobol_total: Vec::new(),
        });
    }
    Ok(qois)
}

/// What the posterior predicts of new specimens' curves, if it does.
pub(super) fn predicted_curves(
    inputs: &Inputs<'_>,
) -> Result<Option<PredictedBand>, WorkflowError> {
    let Some(path) = inputs.file_if_there("predictive_curves.csv") else { return Ok(None) };
    let names = QUANTILES.map(|p| format!("force_N_q{:02.0}", 100.0 * p));
    let columns: Vec<&str> = names.iter().map(String::as_str).collect();
    let table = CsvTable::read(&path, &[&["displacement_mm"][..], &columns].concat())?;
    let column = |name: &str| table.rows().map(|row| row.number(name)).collect::<Result<_, _>>();
    let mut band =
        PredictedBand { displacement_mm: column("displacement_mm")?, ..Default::default() };
    for (force_n, name) in band.force_n.iter_mut().zip(columns) {
        *force_n = column(name)?;
    }
    Ok(Some(band))
}

/// Damage as it grows, one picture a state.
pub(super) fn damage(inputs: &Inputs<'_>) -> Result<Vec<DamageState>, WorkflowError> {
    let path = inputs.file("fields/map.csv")?;
    let table = CsvTable::read(&path, &["displacement_mm", "force_N", "picture"])?;
    let mut states = Vec::new();
    for row in table.rows() {
        let picture = inputs.file(row.text("picture"))?;
        states.push(DamageState {
            displacement_mm: row.number("displacement_mm")?,
            force_n: row.number("force_N")?,
            picture: std::fs::read(&picture).map_err(|e| WorkflowError::io(&picture, e))?,
        });
    }
    Ok(states)
}
