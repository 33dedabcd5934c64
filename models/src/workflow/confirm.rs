//! Stage `confirm`: simulations at the posterior mode and at posterior draws, compared with the experiments.

use std::borrow::Cow;
use std::path::Path;

use fem::{RunInput, gmsh, write_curve};

use super::WorkflowError;
use super::fitted::read_experiments;
use super::map_fields::write_fields;
use super::mesh_error::mesh_errors;
use super::runs::run_ensemble;
use super::simulator::{Simulator, quantities};
use super::task::Task;
use crate::case::Parameter;
use crate::error::InputError;
use crate::fracture::column_means;
use crate::table::CsvTable;

pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    baseline(task)?;
    let (names, mode) = read_map(&inputs.file("map.csv")?)?;
    let mut points = vec![mode];
    points.extend(read_draws(&inputs.file("posterior.csv")?, &names, inputs.confirm().draws)?);
    let labels: Vec<String> = (0..points.len())
        .map(|i| if i == 0 { "map".to_owned() } else { format!("draw-{i}") })
        .collect();
    let runs: Vec<RunInput> =
        points.into_iter().enumerate().map(|(i, inputs)| RunInput { id: i + 1, inputs }).collect();
    let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
    let simulator = Simulator::new(&inputs.setup(), mesh, parameters(&names)?)?;
    let records = run_ensemble(task, "confirm", &names, &runs, &|_| Ok(Cow::Borrowed(&simulator)))?;

    let qoi = inputs.qoi();
    let columns: Vec<_> = qoi.quantities.iter().map(|q| q.column()).collect();
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let mut rows = Vec::new();
    for (record, label) in records.iter().zip(&labels) {
        task.product(&format!("curves/{label}.csv"), |path| write_curve(path, &record.curve))?;
        let qois = quantities(record, qoi);
        if let Err(reason) = &qois {
            task.warn(&format!(
                "The simulation at {label} has no quantities of interest: {reason}."
            ));
        }
        let qois: Vec<String> = qois.map_or_else(
            |_| vec![String::new(); columns.len()],
            |values| values.iter().map(f64::to_string).collect(),
        );
        let values = record.inputs.iter().map(f64::to_string);
        rows.push([label.clone()].into_iter().chain(values).chain(qois).collect::<Vec<_>>());
    }
    let header =
        ["run"].into_iter().chain(names.iter().map(String::as_str)).chain(columns.iter().copied());
    task.write_csv("confirm_runs.csv", header, rows)?;

    let map = quantities(&records[0], qoi).map_err(|reason| {
        WorkflowError::Unusable(format!("the simulation at the mode: {reason}"))
    })?;
    write_fields(task, &simulator, &records[0].inputs, &records[0].curve)?;
    let mesh_errors = mesh_errors(task, &names, parameters(&names)?, &records[0], &map)?;
    let experiments = column_means(&read_experiments(inputs, &columns)?);
    let errors: Vec<f64> =
        map.iter().zip(&experiments).map(|(map, mean)| 100.0 * (map / mean - 1.0).abs()).collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let rows = columns.iter().enumerate().map(|(m, column)| {
        let numbers = [experiments[m], map[m], errors[m]].map(|x| x.to_string());
        let mesh = mesh_errors.as_ref().map_or_else(String::new, |errors| errors[m].to_string());
        [column.to_string()].into_iter().chain(numbers).chain([mesh]).collect::<Vec<_>>()
    });
    let rows: Vec<_> = rows.collect();
    let header =
        ["qoi", "experiment_mean", "map_simulation", "percent_error", "mesh_error_percent"];
    task.write_csv("confirm.csv", header, rows)?;
    let mut told =
        format!("the simulation at the mode is within {worst:.2} % of the experimental means");
    if let Some(errors) = mesh_errors {
        let errors: Vec<String> = errors.iter().map(|error| format!("{error:+.1}")).collect();
        told += &format!("; error of its mesh, estimated: {} %", errors.join(", "));
    }
    Ok(told)
}

/// Simulates the case with its uncalibrated materials, for comparison with the simulation of the calibrated materials.
fn baseline(task: &Task<'_>) -> Result<(), WorkflowError> {
    let inputs = &task.inputs;
    let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
    let simulator = Simulator::new(&inputs.setup(), mesh, Vec::new())?;
    let run = RunInput { id: 1, inputs: Vec::new() };
    let records =
        run_ensemble(task, "confirm/baseline", &[], &[run], &|_| Ok(Cow::Borrowed(&simulator)))?;
    task.product("curves/baseline.csv", |path| write_curve(path, &records[0].curve))
}

/// Returns the parameters with these paths.
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
