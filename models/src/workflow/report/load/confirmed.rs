//! Quantities of interest, measured, predicted and simulated at the mode, and damage there.

use super::super::super::WorkflowError;
use super::super::super::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::{DamageState, Qoi};
use crate::table::CsvTable;

/// The quantities of interest of the specimens.
pub(super) fn experiments(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    qois: &mut [Qoi],
) -> Result<(), WorkflowError> {
    let columns: Vec<_> = quantities.iter().map(|quantity| quantity.column()).collect();
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &columns)?;
    for (qoi, name) in qois.iter_mut().zip(&columns) {
        qoi.experiments = table.rows().map(|row| row.number(name)).collect::<Result<_, _>>()?;
    }
    Ok(())
}

/// Those that new specimens will show.
pub(super) fn predictive(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    qois: &mut [Qoi],
) -> Result<(), WorkflowError> {
    let columns: Vec<_> = quantities.iter().map(|quantity| quantity.column()).collect();
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let path = inputs.file("predictive.csv")?;
    let table = CsvTable::read(&path, &columns)?;
    for (qoi, name) in qois.iter_mut().zip(&columns) {
        // a draw that could not be predicted is no number
        qoi.predictive = table.rows().filter_map(|row| row.number(name).ok()).collect();
    }
    Ok(())
}

/// Those of the simulation at the mode.
pub(super) fn at_the_mode(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    qois: &mut [Qoi],
) -> Result<(), WorkflowError> {
    let path = inputs.file("confirm.csv")?;
    let columns = ["qoi", "map_simulation", "percent_error", "mesh_error_percent"];
    let table = CsvTable::read(&path, &columns)?;
    for (qoi, quantity) in qois.iter_mut().zip(quantities) {
        let row = table.named("qoi", &quantity.column())?;
        qoi.map = row.number("map_simulation")?;
        qoi.percent_error = row.number("percent_error")?;
        qoi.mesh_error_percent = row.text("mesh_error_percent").parse().ok();
    }
    Ok(())
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
