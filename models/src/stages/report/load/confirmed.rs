//! Loads quantities of interest (measured, predicted, simulated at the mode) and the damage at the mode.

use crate::error::InputError;
use crate::experiments::specimen_quantities::read_cell;
use crate::forward::predicted_curves::band_end;
use crate::pipeline::inputs::Inputs;
use crate::predicted_curve::QUANTILES;
use crate::qoi::Quantity;
use crate::report::{DamageState, PredictedBand, Qoi};
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Loads the measured quantities of interest; quantities that a specimen lacks are omitted.
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
        let cells = table.rows().map(|row| read_cell(&row, name, false));
        let values = cells.collect::<Result<Vec<f64>, _>>()?;
        qoi.experiments = values.into_iter().filter(|value| !value.is_nan()).collect();
    }
    Ok(())
}

/// Reads the columns of the quantities from a table. An entry that is not a number is an error in its place.
fn columns(
    inputs: &Inputs<'_>,
    file: &str,
    quantities: &[Quantity],
) -> Result<Vec<Vec<Result<f64, InputError>>>, WorkflowError> {
    let names: Vec<_> = quantities.iter().map(|quantity| quantity.column()).collect();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    let path = inputs.file(file)?;
    let table = CsvTable::read(&path, &names)?;
    let column = |name: &&str| table.rows().map(|row| row.number(name)).collect();
    Ok(names.iter().map(column).collect())
}

/// Loads the predicted quantities of new specimens.
pub(super) fn predictive(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    qois: &mut [Qoi],
) -> Result<(), WorkflowError> {
    for (qoi, values) in qois.iter_mut().zip(columns(inputs, "predictive.csv", quantities)?) {
        // skip draws for which the prediction failed, whose entry is not a number
        qoi.predictive = values.into_iter().filter_map(Result::ok).collect();
    }
    Ok(())
}

/// Loads the quantities of the simulation at the mode.
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

/// Loads the predicted curves of new specimens; none if curves were not predicted.
pub(super) fn predicted_curves(
    inputs: &Inputs<'_>,
) -> Result<Option<PredictedBand>, WorkflowError> {
    let Some(path) = inputs.file_if_there("predictive_curves.csv") else { return Ok(None) };
    let names = QUANTILES.map(|p| format!("force_N_q{:02.0}", 100.0 * p));
    let columns: Vec<&str> = names.iter().map(String::as_str).collect();
    let table = CsvTable::read(&path, &[&["displacement_mm"][..], &columns].concat())?;
    let column = |name: &str| table.rows().map(|row| row.number(name)).collect::<Result<_, _>>();
    let mut band = PredictedBand {
        displacement_mm: column("displacement_mm")?,
        end: band_end(inputs),
        ..Default::default()
    };
    for (force_n, name) in band.force_n.iter_mut().zip(columns) {
        *force_n = column(name)?;
    }
    Ok(Some(band))
}

/// Loads the damage states in their order, one picture per state.
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
