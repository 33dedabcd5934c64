//! Loads curves of the ensemble and measured curves, with the findings of the curve checks.

use fem::read_curve;
use surrogate::Dataset;

use crate::case::MachineCase;
use crate::error::InputError;
use crate::experiment::TestCurve;
use crate::experiments::experiment_inputs;
use crate::experiments::mesh_scale::MeshScale;
use crate::experiments::preparation::Preparation;
use crate::experiments::specimen_quantities::read_cell;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::{Finding, Points, Results, SpecimenFacts};
use crate::results_folder::error::WorkflowError;
use crate::simulation::recorded::{recorded_run, recorded_with};
use crate::stages::ensemble::so_far;
use crate::table::{CsvTable, TableRow};

/// Returns the curve of a confirming simulation as a testing machine records it, starting at the origin. Properties of
/// the machine that are parameters of the simulation have the values of these parameters.
pub(super) fn confirmed(inputs: &Inputs<'_>, label: &str) -> Result<Points, WorkflowError> {
    let curve = read_curve(inputs.file(&format!("curves/{label}.csv"))?)?;
    let path = inputs.file("confirm_runs.csv")?;
    let runs = CsvTable::read(&path, &["run"])?;
    // the baseline has no calibrated parameters, and therefore no row
    let Some(row) = runs.rows().find(|row| row.text("run") == label) else {
        return Ok(points_of(recorded_with([], &curve)));
    };
    let calibrated = [MachineCase::COMPLIANCE, MachineCase::FORCE_OFFSET].into_iter();
    let calibrated = calibrated.filter(|column| runs.has_column(column));
    let machine = calibrated.map(|column| row.number(column).map(|value| (column, value)));
    let machine = machine.collect::<Result<Vec<_>, InputError>>()?;
    Ok(points_of(recorded_with(machine, &curve)))
}

/// The curve of a confirming simulation, see [`confirmed`]; empty for a simulation that has quantities and no curve.
pub(super) fn confirmed_if_there(
    inputs: &Inputs<'_>,
    label: &str,
) -> Result<Points, WorkflowError> {
    // the built-in simulation always writes the curve
    let name = format!("curves/{label}.csv");
    match inputs.case().is_built_in() || inputs.file_if_there(&name).is_some() {
        true => confirmed(inputs, label),
        false => Ok(Points::new()),
    }
}

fn points_of(curve: TestCurve) -> Points {
    curve.displacement_mm.into_iter().zip(curve.force_n).collect()
}

/// Loads the findings of the checks of measured curves.
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

/// Loads the runs of a finished ensemble: corrected quantities of interest, curves, failures.
pub(super) fn ensemble(
    inputs: &Inputs<'_>,
    data: &Dataset,
    results: &mut Results,
) -> Result<(), WorkflowError> {
    for (m, qoi) in results.qois.iter_mut().enumerate() {
        qoi.ensemble = data.rows().map(|(_, values)| values[m]).collect();
    }
    for i in 0..data.len() {
        let note = |name: &str| data.note(i, name).unwrap_or_default();
        results.ensemble_seconds += note("seconds").parse().unwrap_or(0.0);
        let name = format!("curves/run-{:0>3}.csv", note("run"));
        // a simulation that has quantities and no curve writes no file
        if inputs.case().is_built_in() || inputs.file_if_there(&name).is_some() {
            let curve = read_curve(inputs.file(&name)?)?;
            let names = data.inputs().iter().map(|input| input.name.as_str());
            let of_run = names.zip(data.row(i).0.iter().copied());
            results.ensemble.push(points_of(recorded_with(of_run, &curve)));
        }
    }
    let path = inputs.file("failed_runs.csv")?;
    for row in CsvTable::read(&path, &["run", "seconds", "reason"])?.rows() {
        results.ensemble_seconds += row.number("seconds")?;
        results.failures.push((row.number("run")? as usize, row.text("reason").to_owned()));
    }
    Ok(())
}

/// Loads the ended runs of an unfinished ensemble; none if the ensemble cannot be started yet.
pub(super) fn ensemble_so_far(inputs: &Inputs<'_>, results: &mut Results) {
    let Ok((runs, meshes)) = so_far(inputs) else { return };
    for (record, values) in runs.usable() {
        results.ensemble_seconds += record.seconds;
        if !record.curve.is_empty() {
            results.ensemble.push(points_of(recorded_run(record)));
        }
        results.qois.iter_mut().zip(values).for_each(|(qoi, value)| qoi.ensemble.push(*value));
    }
    for (record, reason) in runs.failed() {
        results.failures.push((record.id, reason.to_owned()));
    }
    if meshes > 1 && !results.ensemble.is_empty() {
        results.notes.push(format!(
            "The runs on the first of {meshes} meshes are shown without corrections. The corrections are computed when all \
             runs have ended."
        ));
    }
}

/// Loads the measured curves, scaled to the size of the mesh as in the calibration.
///
/// Also loads the sizes and the quantities of the specimens.
pub(super) fn experiments(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    results: &mut Results,
) -> Result<(), WorkflowError> {
    if experiment_inputs::measured_values(inputs).is_some() {
        return without_curves(inputs, quantities, results);
    }
    let table = experiment_inputs::chosen(inputs, experiment_inputs::specimen_table(inputs)?)?;
    let path = inputs.file("experiments.csv")?;
    let columns: Vec<_> = quantities.iter().map(|quantity| quantity.column()).collect();
    let columns = columns.iter().map(AsRef::as_ref);
    let required: Vec<&str> = ["id", MeshScale::COLUMNS[0]].into_iter().chain(columns).collect();
    let used = CsvTable::read(&path, &required)?;
    let preparation = Preparation::of(inputs);
    let looked = inputs.file("curve_checks.csv")?;
    let looked = CsvTable::read(&looked, &["id", "finding", "value"])?;
    let end = results.ensemble.iter().flatten().map(|p| p.0).fold(0.0, f64::max);
    for specimen in table.specimens {
        let row = used.named("id", &specimen.id)?;
        let scale = MeshScale::of_row(row)?;
        let values = quantities.iter().map(|quantity| read_cell(&row, &quantity.column(), false));
        results.specimens.push(SpecimenFacts {
            id: specimen.id.clone(),
            group: specimen.group.clone(),
            size_mm: Some([specimen.height_mm, specimen.radius_mm]),
            values: values.collect::<Result<_, _>>()?,
        });
        if scale.displacement != 1.0 {
            results.notes.push(format!(
                "{} is {} mm high: its displacements are scaled by {:.4} to the height of the mesh.",
                specimen.id, specimen.height_mm, scale.displacement
            ));
        }
        if scale.force != 1.0 {
            results.notes.push(format!(
                "{} has a radius of {} mm: its forces are scaled by {:.4} to the section of the mesh.",
                specimen.id, specimen.radius_mm, scale.force
            ));
        }
        let toe = if preparation.corrects_toe() { toe_mm(&looked, &specimen.id)? } else { 0.0 };
        let curve = preparation.specimen_curve(&specimen.curve).shift_displacement(-toe);
        let curve = scale.apply(&curve);
        // points far beyond the simulated range would compress the rest of the figure
        let curve = points_of(curve).into_iter();
        let is_shown = |p: &(f64, f64)| end == 0.0 || p.0 <= 1.05 * end;
        results.experiments.push((specimen.id, curve.filter(is_shown).collect()));
    }
    Ok(())
}

/// Loads the quantities of specimens that have no curves.
fn without_curves(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    results: &mut Results,
) -> Result<(), WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let columns: Vec<_> = quantities.iter().map(|quantity| quantity.column()).collect();
    let columns = columns.iter().map(AsRef::as_ref);
    let required: Vec<&str> = ["id", "group"].into_iter().chain(columns).collect();
    for row in CsvTable::read(&path, &required)?.rows() {
        let values = quantities.iter().map(|quantity| read_cell(&row, &quantity.column(), false));
        results.specimens.push(SpecimenFacts {
            id: row.text("id").to_owned(),
            group: row.text("group").to_owned(),
            size_mm: None,
            values: values.collect::<Result<_, _>>()?,
        });
    }
    Ok(())
}

/// Displacement (mm) at which the force of a specimen begins to rise.
fn toe_mm(looked: &CsvTable<'_>, id: &str) -> Result<f64, InputError> {
    let mut rows = looked.rows();
    let toe = rows.find(|row| row.text("id") == id && row.text("finding") == "toe");
    toe.map_or(Ok(0.0), |row| row.number("value"))
}
