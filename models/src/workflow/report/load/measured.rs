//! Curves: those of the ensemble, those measured, and what was seen in them.

use fem::read_curve;
use surrogate::Dataset;

use super::super::super::WorkflowError;
use super::super::super::inputs::Inputs;
use crate::case::Toe;
use crate::error::InputError;
use crate::report::{Finding, Points, Results};
use crate::table::{CsvTable, TableRow};

/// A simulated curve from the origin on.
pub(super) fn curve(inputs: &Inputs<'_>, name: &str) -> Result<Points, WorkflowError> {
    let points = read_curve(inputs.file(name)?)?;
    // a recorded curve starts with its first step
    Ok([(0.0, 0.0)]
        .into_iter()
        .chain(points.iter().map(|p| (p.displacement_mm, p.force_n)))
        .collect())
}

/// What was found when the measured curves were looked at.
pub(super) fn findings(inputs: &Inputs<'_>) -> Result<Vec<Finding>, WorkflowError> {
    let path = inputs.file("curve_checks.csv")?;
    let table = CsvTable::read(&path, &["id", "finding", "help"])?;
    let finding = |row: TableRow<'_>| Finding {
        specimen: row.text("id").to_owned(),
        finding: row.text("finding").replace('_', " "),
        help: row.text("help").to_owned(),
    };
    Ok(table.rows().map(finding).collect())
}

pub(super) fn ensemble(
    inputs: &Inputs<'_>,
    data: &Dataset,
    results: &mut Results,
) -> Result<(), WorkflowError> {
    for i in 0..data.len() {
        let note = |name: &str| data.note(i, name).unwrap_or_default();
        results.ensemble_seconds += note("seconds").parse().unwrap_or(0.0);
        results.ensemble.push(curve(inputs, &format!("curves/run-{:0>3}.csv", note("run")))?);
    }
    let path = inputs.file("failed_runs.csv")?;
    for row in CsvTable::read(&path, &["run", "seconds", "reason"])?.rows() {
        results.ensemble_seconds += row.number("seconds")?;
        results.failures.push((row.number("run")? as usize, row.text("reason").to_owned()));
    }
    Ok(())
}

/// Measured curves, displacements scaled to the height of the mesh as in the calibration.
pub(super) fn experiments(inputs: &Inputs<'_>, results: &mut Results) -> Result<(), WorkflowError> {
    let table = inputs.chosen(inputs.specimen_table()?)?;
    let path = inputs.file("experiments.csv")?;
    let used = CsvTable::read(&path, &["id", "displacement_factor"])?;
    let corrected = inputs.toe() == Toe::Correct;
    let looked = inputs.file("curve_checks.csv")?;
    let looked = CsvTable::read(&looked, &["id", "finding", "value"])?;
    let end = results.ensemble.iter().flatten().map(|p| p.0).fold(0.0, f64::max);
    for specimen in table.specimens {
        let factor = used.named("id", &specimen.id)?.number("displacement_factor")?;
        if factor != 1.0 {
            results.notes.push(format!(
                "{} is {} mm high: its displacements are scaled by {factor:.4} to the height of \
                 the mesh.",
                specimen.id, specimen.height_mm
            ));
        }
        let toe = if corrected { toe_mm(&looked, &specimen.id)? } else { 0.0 };
        let curve = specimen.curve.shift_displacement(-toe).scale_displacement(factor);
        // what was measured beyond the simulated range would hide the rest
        let points = curve.displacement_mm.into_iter().zip(curve.force_n);
        results.experiments.push((specimen.id, points.filter(|p| p.0 <= 1.05 * end).collect()));
    }
    Ok(())
}

/// Where a specimen's curve begins to carry load.
fn toe_mm(looked: &CsvTable<'_>, id: &str) -> Result<f64, InputError> {
    let mut rows = looked.rows();
    let toe = rows.find(|row| row.text("id") == id && row.text("finding") == "toe");
    toe.map_or(Ok(0.0), |row| row.number("value"))
}
