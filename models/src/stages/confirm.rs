//! Stage `confirm`: simulations at the posterior mode and at posterior draws, compared with the experiments.

use std::borrow::Cow;
use std::path::Path;

use fem::{RunInput, RunRecord, gmsh, write_curve};

use crate::case::Parameter;
use crate::error::InputError;
use crate::forward::fitted::read_experiments;
use crate::fracture::column_means;
use crate::pipeline::run_key::RunKey;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::runs::ensemble_runs::{NamedRuns, run_named};
use crate::runs::map_fields::write_fields;
use crate::runs::mesh_error::mesh_errors;
use crate::runs::run_source::RequestedRuns;
use crate::runs::run_sources::source_of;
use crate::simulation::run_values::quantities;
use crate::simulation::simulator::Simulator;
use crate::table::CsvTable;

/// Description of the runs in the progress bar.
const LABEL: &str = "runs at the mode and at draws";

/// Key and files on which the points of the simulations depend.
const KEYS_OF_POINTS: [&str; 1] = ["confirm.draws"];
const FILES_OF_POINTS: [&str; 2] = ["map.csv", "posterior.csv"];

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    if !inputs.is_built_in() {
        return confirm_outside(task);
    }
    baseline(task)?;
    let Points { names, runs } = Points::read(task)?;
    let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
    let simulator = Simulator::new(&inputs.setup(), mesh, parameters(&names)?)?;
    let files = [&FILES_OF_POINTS[..], &["mesh.msh"]].concat();
    let named = NamedRuns {
        folder: "confirm",
        label: LABEL,
        key: &RunKey::of_simulations(inputs, &KEYS_OF_POINTS, &files),
        names: &names,
        runs: &runs,
        wait: true,
    };
    let records = run_named(task, named, &|_| Ok(Cow::Borrowed(&simulator)))?;

    let map = write_runs(task, &names, &records)?;
    write_fields(task, &simulator, &records[0].inputs, &records[0].curve)?;
    let mesh_errors = mesh_errors(task, &names, parameters(&names)?, &records[0], &map)?;
    let mut words = write_misfits(task, &map, mesh_errors.as_deref())?;
    if let Some(errors) = mesh_errors {
        let errors: Vec<String> = errors.iter().map(|error| format!("{error:+.1}")).collect();
        words += &format!("; error of its mesh, estimated: {} %", errors.join(", "));
    }
    Ok(words)
}

/// Runs the source outside this program at the mode and at posterior draws. If the source consists of finished runs,
/// no simulation is possible.
fn confirm_outside(task: &Task<'_>) -> Result<String, WorkflowError> {
    let source = source_of(&task.inputs)?;
    if source.parameter_points().is_some() {
        return Ok("imported runs cannot be repeated at the mode: nothing to confirm".to_owned());
    }
    let Points { names, runs } = Points::read(task)?;
    let key = RunKey::new(&task.inputs, &KEYS_OF_POINTS, &FILES_OF_POINTS);
    let key = source.identified(key, &task.inputs);
    let named = NamedRuns {
        folder: "confirm",
        label: LABEL,
        key: &key,
        names: &names,
        runs: &runs,
        wait: true,
    };
    let requested = RequestedRuns { task, level: None, specimens: None, named };
    let records = source.records(&requested)?;
    let map = write_runs(task, &names, &records)?;
    write_misfits(task, &map, None)
}

/// Points of the simulations: the mode, and posterior draws.
struct Points {
    names: Vec<String>,
    runs: Vec<RunInput>,
}

impl Points {
    fn read(task: &Task<'_>) -> Result<Self, WorkflowError> {
        let inputs = &task.inputs;
        let (names, mode) = read_map(&inputs.file("map.csv")?)?;
        let mut parameter_points = vec![mode];
        parameter_points.extend(read_draws(
            &inputs.file("posterior.csv")?,
            &names,
            inputs.confirm().draws,
        )?);
        let run = |(i, inputs)| RunInput { id: i + 1, inputs };
        let runs = parameter_points.into_iter().enumerate().map(run).collect();
        Ok(Self { names, runs })
    }
}

/// Writes the curves and the quantities of the simulations. Returns the quantities at the mode.
///
/// # Errors
/// Fails if the simulation at the mode has no quantities, or if a file cannot be written.
fn write_runs(
    task: &Task<'_>,
    names: &[String],
    records: &[RunRecord],
) -> Result<Vec<f64>, WorkflowError> {
    let qoi = task.inputs.qoi();
    let mut rows = Vec::new();
    for (i, record) in records.iter().enumerate() {
        let label = if i == 0 { "map".to_owned() } else { format!("draw-{i}") };
        if !record.curve.is_empty() || record.values.is_empty() {
            task.product(&format!("curves/{label}.csv"), |path| write_curve(path, &record.curve))?;
        }
        let qois = quantities(record, qoi);
        if let Err(reason) = &qois {
            task.warn(&format!(
                "The simulation at {label} has no quantities of interest: {reason}."
            ));
        }
        let qois: Vec<String> = qois.map_or_else(
            |_| vec![String::new(); qoi.quantities.len()],
            |values| values.iter().map(f64::to_string).collect(),
        );
        let values = record.inputs.iter().map(f64::to_string);
        rows.push([label].into_iter().chain(values).chain(qois).collect::<Vec<_>>());
    }
    let header = ["run".to_owned()].into_iter().chain(names.iter().cloned()).chain(columns(task));
    task.write_csv("confirm_runs.csv", header, rows)?;
    quantities(&records[0], qoi)
        .map_err(|reason| WorkflowError::Unusable(format!("the simulation at the mode: {reason}")))
}

/// Columns of the compared quantities.
fn columns(task: &Task<'_>) -> Vec<String> {
    task.inputs.qoi().quantities.iter().map(|q| q.column().into_owned()).collect()
}

/// Writes `confirm.csv`: the quantities at the mode against the means of the specimens. Returns the largest misfit in
/// words.
fn write_misfits(
    task: &Task<'_>,
    map: &[f64],
    mesh_errors: Option<&[f64]>,
) -> Result<String, WorkflowError> {
    let columns = columns(task);
    let experiments = column_means(&read_experiments(&task.inputs, &columns)?);
    let errors: Vec<f64> =
        map.iter().zip(&experiments).map(|(map, mean)| 100.0 * (map / mean - 1.0).abs()).collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let rows = columns.iter().enumerate().map(|(m, column)| {
        let percentages = [experiments[m], map[m], errors[m]].map(|x| x.to_string());
        let mesh = mesh_errors.map_or_else(String::new, |errors| errors[m].to_string());
        [column.clone()].into_iter().chain(percentages).chain([mesh]).collect::<Vec<_>>()
    });
    let header =
        ["qoi", "experiment_mean", "map_simulation", "percent_error", "mesh_error_percent"];
    task.write_csv("confirm.csv", header, rows.collect::<Vec<_>>())?;
    Ok(format!("the simulation at the mode is within {worst:.2} % of the experimental means"))
}

/// Simulates the case with its uncalibrated materials, for comparison with the simulation of the calibrated materials.
fn baseline(task: &Task<'_>) -> Result<(), WorkflowError> {
    let inputs = &task.inputs;
    let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
    let simulator = Simulator::new(&inputs.setup(), mesh, Vec::new())?;
    let run = RunInput { id: 1, inputs: Vec::new() };
    let named = NamedRuns {
        folder: "confirm/baseline",
        label: "run of the case without calibration",
        key: &RunKey::of_simulations(inputs, &[], &["mesh.msh"]),
        names: &[],
        runs: &[run],
        wait: true,
    };
    let records = run_named(task, named, &|_| Ok(Cow::Borrowed(&simulator)))?;
    task.product("curves/baseline.csv", |path| write_curve(path, &records[0].curve))
}

/// Returns the parameters with the given paths.
fn parameters(names: &[String]) -> Result<Vec<Parameter>, WorkflowError> {
    names.iter().map(|name| name.parse().map_err(WorkflowError::Unusable)).collect()
}

/// Reads names and values of the parameters at the posterior mode.
fn read_map(path: &Path) -> Result<(Vec<String>, Vec<f64>), InputError> {
    let table = CsvTable::read(path, &["parameter", "map"])?;
    table.rows().map(|row| Ok((row.text("parameter").to_owned(), row.number("map")?))).collect()
}

/// Reads `n` posterior draws, evenly spaced over all chains.
fn read_draws(path: &Path, names: &[String], n: usize) -> Result<Vec<Vec<f64>>, InputError> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let table = CsvTable::read(path, &names)?;
    let rows: Vec<_> = table.rows().collect();
    (0..n.min(rows.len()))
        .map(|k| {
            let row = rows[(2 * k + 1) * rows.len() / (2 * n)];
            names.iter().map(|name| row.number(name)).collect()
        })
        .collect()
}
