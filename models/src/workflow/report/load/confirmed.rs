//! The simulation at the mode: quantities and damage.

use surrogate::Dataset;

use super::super::super::WorkflowError;
use super::super::super::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::{DamageState, Qoi};
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
    let columns: Vec<_> = quantities.iter().map(|quantity| quantity.column()).collect();
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let experiments = CsvTable::read(&experiments, &columns)?;
    let predictive = CsvTable::read(&predictive, &columns)?;
    let mut qois = Vec::new();
    for (m, (quantity, &name)) in quantities.iter().zip(&columns).enumerate() {
        let row = confirm.named("qoi", name)?;
        qois.push(Qoi {
            label: quantity.label().into_owned(),
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
