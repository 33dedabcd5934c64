//! Loads the comparisons with held-out specimens, from the files of the stage `validate`.

use crate::case::CaseFile;
use crate::error::InputError;
use crate::experiments::validation_folders::folder_of;
use crate::forward::predicted_curves::specimen_curves;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::{
    PredictedBand, ValidatedQuantity, ValidationCoverage, ValidationResult, ValidationVerdict,
};
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

/// Columns of the quantiles of a quantity, and of the force in a band.
const QUANTILES: [&str; 5] = ["q05", "q25", "median", "q75", "q95"];
const FORCES: [&str; 5] =
    ["force_N_q05", "force_N_q25", "force_N_q50", "force_N_q75", "force_N_q95"];

/// Loads one entry per validation of the case; empty without `[[validation]]`.
pub(super) fn validations(inputs: &Inputs<'_>) -> Result<Vec<ValidationResult>, WorkflowError> {
    let entries = inputs.validation();
    let mut results = Vec::new();
    if entries.is_empty() {
        return Ok(results);
    }
    let summary = inputs.file("validation_summary.csv")?;
    let summary = CsvTable::read(&summary, &["validation", "qoi", "method", "verdict"])?;
    let specimens = inputs.file("validation.csv")?;
    let specimens = CsvTable::read(&specimens, &["validation", "qoi", "specimen", "measured"])?;
    for entry in entries {
        let is_own = |row: &TableRow<'_>| row.text("validation") == entry.name;
        let mut result = ValidationResult { name: entry.name.clone(), ..Default::default() };
        for row in summary.rows().filter(is_own) {
            result.method = row.text("method").to_owned();
            result.draws = row.number("draws")? as usize;
            let column = row.text("qoi");
            let measured = specimens.rows().filter(is_own).filter(|r| r.text("qoi") == column);
            result.quantities.push(quantity(row, &measured.collect::<Vec<_>>())?);
        }
        if let Some(path) = inputs.file_if_there("validation_curves.csv") {
            let table = CsvTable::read(&path, &["validation", "displacement_mm"])?;
            let rows: Vec<_> = table.rows().filter(is_own).collect();
            if !rows.is_empty() {
                result.band = Some(band(&rows)?);
                result.curves = curves(inputs, &entry.name)?;
            }
        }
        results.push(result);
    }
    Ok(results)
}

/// Loads the coverage of the intervals; empty without a quantity whose scatter is predicted.
pub(super) fn coverage(inputs: &Inputs<'_>) -> Result<Vec<ValidationCoverage>, WorkflowError> {
    if inputs.validation().is_empty() {
        return Ok(Vec::new());
    }
    let path = inputs.file("validation_coverage.csv")?;
    let table = CsvTable::read(&path, &["level", "inside", "total", "low", "high"])?;
    let row = |row: TableRow<'_>| {
        Ok(ValidationCoverage {
            level: row.number("level")?,
            counts: [row.number("inside")? as usize, row.number("total")? as usize],
            interval: [row.number("low")?, row.number("high")?],
        })
    };
    Ok(table.rows().map(row).collect::<Result<_, InputError>>()?)
}

/// Loads a quantity from its row of the summary and from the rows of its specimens.
fn quantity(row: TableRow<'_>, measured: &[TableRow<'_>]) -> Result<ValidatedQuantity, InputError> {
    let optional = |column: &str| row.text(column).parse::<f64>().ok();
    let column = row.text("qoi");
    let label = Quantity::of_column(column)
        .map_or_else(|| column.to_owned(), |quantity_of_column| quantity_of_column.label());
    let quantiles = measured.first().map(|row| QUANTILES.map(|name| row.text(name).parse().ok()));
    let specimens = measured
        .iter()
        .map(|row| Ok((row.text("specimen").to_owned(), row.number("measured")?)))
        .collect::<Result<_, InputError>>()?;
    let inside = ["inside50", "inside90"].map(|column| optional(column).map(|n| n as usize));
    Ok(ValidatedQuantity {
        label,
        quantiles: quantiles.unwrap_or_default(),
        specimens,
        inside: inside[0].zip(inside[1]).map(|(half, most)| [half, most]),
        crps: optional("mean_crps"),
        means: [row.number("measured_mean")?, row.number("predicted_mean")?],
        deviation: optional("deviation"),
        verdict: ValidationVerdict::named(row.text("verdict")).unwrap_or_default(),
    })
}

fn band(rows: &[TableRow<'_>]) -> Result<PredictedBand, InputError> {
    let mut band = PredictedBand::default();
    for row in rows {
        band.displacement_mm.push(row.number("displacement_mm")?);
        for (forces, column) in band.force_n.iter_mut().zip(FORCES) {
            forces.push(row.number(column)?);
        }
    }
    Ok(band)
}

/// Measured curves of the held-out specimens, scaled to the size of the mesh.
fn curves(inputs: &Inputs<'_>, name: &str) -> Result<Vec<Vec<(f64, f64)>>, WorkflowError> {
    let folder = folder_of(name);
    let dir = inputs.folder().join(&folder);
    let file = CaseFile::read(&dir.join("case.toml"))?;
    let validation_inputs = inputs.of_folder(&file, &dir).of_held_out();
    let curves = specimen_curves(&validation_inputs)?;
    inputs.reads_in_folder(&validation_inputs, &folder);
    let readings = |curve: crate::experiment::TestCurve| {
        curve.displacement_mm.into_iter().zip(curve.force_n).collect()
    };
    Ok(curves.into_iter().map(readings).collect())
}
