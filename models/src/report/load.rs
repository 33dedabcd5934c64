//! The numbers of a report, from the files that the stages left.

use std::path::Path;

use fem::read_curve;
use surrogate::{FitReport, OrderRule, Pce};

use super::results::{Curve, Order, Parameter, Qoi, Results};
use crate::case::{CaseFile, PriorCase};
use crate::csv_table::{CsvTable, Row};
use crate::error::InputError;
use crate::experiment::SpecimenTable;
use crate::qoi::Qois;
use crate::workflow::WorkflowError;

/// In the order of [`PriorCase::NAMES`].
const PARAMETER_LABELS: [&str; 3] = ["E (MPa)", "Gc (N/mm)", "ξ (MPa s)"];
/// In the order of [`Qois::NAMES`].
const QOI_LABELS: [&str; 3] =
    ["initial slope (N/mm)", "peak force (N)", "displacement at peak (mm)"];

/// Reads the results in `dir`.
///
/// # Errors
/// A file that is missing or damaged.
pub(super) fn load(dir: &Path) -> Result<Results, WorkflowError> {
    let file = CaseFile::read(&dir.join("case.toml"))?;
    let pce = Pce::<3, 3>::read(dir.join("surrogate.json"))?;
    let error_file = dir.join("surrogate_error.json");
    let fit: FitReport = serde_json::from_str(&text(&error_file)?)
        .map_err(|e| WorkflowError::File { path: error_file, message: e.to_string() })?;
    let mut results = Results {
        title: title(&file),
        case_toml: text(&file.path)?,
        mesh_svg: text(&dir.join("mesh.svg"))?,
        mesh_facts: facts(&dir.join("mesh.csv"))?,
        map_curve: curve(&dir.join("curves/map.csv"))?,
        orders: orders(&fit),
        chosen_order: fit.order,
        order_rule: rule_in_words(file.case.surrogate.rule),
        parameters: parameters(dir, &file)?,
        summary: summary(&dir.join("summary.csv"))?,
        warnings: text(&dir.join("warnings.txt"))?.lines().map(str::to_owned).collect(),
        settings: settings(&file),
        notes: notes(dir, &file)?,
        qois: qois(dir)?,
        ..Results::default()
    };
    for (qoi, total) in results.qois.iter_mut().zip(pce.sobol().total) {
        qoi.sobol_total = total.to_vec();
    }
    ensemble(dir, &mut results)?;
    experiments(dir, &file, &mut results)?;
    for k in 1..=file.case.confirm.draws {
        results.posterior_curves.push(curve(&dir.join(format!("curves/draw-{k}.csv")))?);
    }
    Ok(results)
}

fn title(file: &CaseFile) -> String {
    let region = file.case.prior.as_ref().map_or("matrix", |prior| prior.region.as_str());
    let experiments = file.case.experiments.as_ref();
    match experiments.and_then(|e| e.laboratory.as_ref()) {
        Some(laboratory) => format!(
            "Calibration of the {region}: {} virtual specimens {}",
            laboratory.specimens, laboratory.group
        ),
        None => match experiments.and_then(|e| e.group.as_deref()) {
            Some(group) => format!("Calibration of the {region}: specimens {group}"),
            None => format!("Calibration of the {region}"),
        },
    }
}

fn rule_in_words(rule: OrderRule) -> String {
    match rule {
        OrderRule::CorrectedLoo => "the order with the least corrected leave-one-out error".into(),
        OrderRule::Split => {
            "the smallest order within 5 % of the least validation error of a 70/30 split".into()
        }
        OrderRule::Fixed(order) => format!("order {order} was asked for"),
    }
}

fn text(path: &Path) -> Result<String, WorkflowError> {
    std::fs::read_to_string(path).map_err(|e| WorkflowError::io(path, &e))
}

fn curve(path: &Path) -> Result<Curve, WorkflowError> {
    let points = read_curve(path)?;
    // a recorded curve starts with its first step
    Ok([(0.0, 0.0)]
        .into_iter()
        .chain(points.iter().map(|p| (p.displacement_mm, p.force_n)))
        .collect())
}

/// The summary table, header first, numbers shortened; constants as the zeros of a Cholesky
/// factor, which have no R-hat, are left out.
fn summary(path: &Path) -> Result<Vec<Vec<String>>, WorkflowError> {
    let short = |cell: &String| cell.parse().map_or_else(|_| cell.clone(), super::page::number);
    let table = CsvTable::read(path, &["rhat"])?;
    let sampled = table.rows().filter(|row| row.text("rhat") != "NaN");
    let mut lines = vec![table.columns().to_vec()];
    lines.extend(sampled.map(|row| row.cells().iter().map(short).collect()));
    Ok(lines)
}

fn facts(path: &Path) -> Result<Vec<(String, String)>, WorkflowError> {
    let table = CsvTable::read(path, &["quantity", "value"])?;
    let fact = |row: Row| {
        let value = row.number("value")?;
        let whole = value.fract() == 0.0 && value.abs() < 1e15;
        let shown = if whole { value.to_string() } else { super::page::number(value) };
        Ok((row.text("quantity").replace('_', " "), shown))
    };
    Ok(table.rows().map(fact).collect::<Result<_, InputError>>()?)
}

/// Errors by order, averaged over the quantities.
fn orders(fit: &FitReport) -> Vec<Order> {
    let mean = |values: &Vec<f64>| super::mean(values);
    fit.orders
        .iter()
        .map(|o| Order {
            order: o.order,
            loo: o.loo.as_ref().map(|e| mean(&e.plain)),
            corrected: o.loo.as_ref().map(|e| mean(&e.corrected)),
            training: o.split.as_ref().map(|e| mean(&e.train)),
            validation: o.split.as_ref().map(|e| mean(&e.validation)),
        })
        .collect()
}

fn parameters(dir: &Path, file: &CaseFile) -> Result<Vec<Parameter>, WorkflowError> {
    let prior = file.case.prior.as_ref().ok_or_else(|| {
        file.error("prior", "", "is missing", "Add a table [prior]: it says what is calibrated.")
    })?;
    let (draws, summary) = (dir.join("posterior.csv"), dir.join("summary.csv"));
    let map = dir.join("map.csv");
    let columns: Vec<&str> = ["chain"].into_iter().chain(PriorCase::NAMES).collect();
    let draws = CsvTable::read(&draws, &columns)?;
    let summary = CsvTable::read(&summary, &["parameter", "mean", "sd", "contraction"])?;
    let map = CsvTable::read(&map, &["parameter", "map"])?;
    let mut parameters = Vec::new();
    for (i, name) in PriorCase::NAMES.into_iter().enumerate() {
        let mut chains: Vec<Vec<f64>> = Vec::new();
        for row in draws.rows() {
            let chain = row.number("chain")? as usize;
            chains.resize_with(chains.len().max(chain + 1), Vec::new);
            chains[chain].push(row.number(name)?);
        }
        let of = |table: &CsvTable<'_>, column: &str| -> Result<f64, InputError> {
            table.named("parameter", name)?.number(column)
        };
        let [lower, upper] = prior.bounds()[i];
        parameters.push(Parameter {
            label: PARAMETER_LABELS[i].to_owned(),
            prior: (lower, upper),
            chains,
            mean: of(&summary, "mean")?,
            sd: of(&summary, "sd")?,
            q05: of(&summary, "q05")?,
            q95: of(&summary, "q95")?,
            contraction: of(&summary, "contraction")?,
            map: of(&map, "map")?,
            truth: map.named("parameter", name)?.text("truth").parse().ok(),
        });
    }
    Ok(parameters)
}

fn qois(dir: &Path) -> Result<Vec<Qoi>, WorkflowError> {
    let (confirm, runs) = (dir.join("confirm.csv"), dir.join("runs.csv"));
    let experiments = dir.join("experiments.csv");
    let confirm = CsvTable::read(&confirm, &["qoi", "map_simulation", "percent_error"])?;
    let runs = CsvTable::read(&runs, &Qois::NAMES)?;
    let experiments = CsvTable::read(&experiments, &Qois::NAMES)?;
    let mut qois = Vec::new();
    for (name, label) in Qois::NAMES.into_iter().zip(QOI_LABELS) {
        let row = confirm.named("qoi", name)?;
        let usable = runs.rows().filter(|row| !row.text(name).is_empty());
        qois.push(Qoi {
            label: label.to_owned(),
            experiments: experiments.rows().map(|r| r.number(name)).collect::<Result<_, _>>()?,
            ensemble: usable.map(|r| r.number(name)).collect::<Result<_, _>>()?,
            map: row.number("map_simulation")?,
            percent_error: row.number("percent_error")?,
            sobol_total: Vec::new(),
        });
    }
    Ok(qois)
}

fn ensemble(dir: &Path, results: &mut Results) -> Result<(), WorkflowError> {
    let path = dir.join("runs.csv");
    let table = CsvTable::read(&path, &["run", "status", "seconds"])?;
    for row in table.rows() {
        let (id, status) = (row.number("run")? as usize, row.text("status"));
        results.ensemble_seconds += row.number("seconds")?;
        if status == "finished" {
            results.ensemble.push(curve(&dir.join(format!("curves/run-{id:03}.csv")))?);
        } else {
            results.failures.push((id, status.to_owned()));
        }
    }
    Ok(())
}

/// Measured curves, displacements scaled to the height of the mesh as in the calibration.
fn experiments(dir: &Path, file: &CaseFile, results: &mut Results) -> Result<(), WorkflowError> {
    let mut table = SpecimenTable::read(&dir.join("laboratory/specimens.csv"))?;
    if let Some(group) = file.case.experiments.as_ref().and_then(|e| e.group.as_deref()) {
        table = table.in_group(group, &file.path)?;
    }
    let path = dir.join("experiments.csv");
    let used = CsvTable::read(&path, &["id", "displacement_factor"])?;
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
        let curve = specimen.curve.scale_displacement(factor);
        // what a laboratory measured beyond the simulated range would hide the rest
        let points = curve.displacement_mm.into_iter().zip(curve.force_n);
        results.experiments.push((specimen.id, points.filter(|p| p.0 <= 1.05 * end).collect()));
    }
    Ok(())
}

/// What belongs to the reading of a virtual laboratory's results.
fn notes(dir: &Path, file: &CaseFile) -> Result<Vec<String>, WorkflowError> {
    let experiments = file.case.experiments.as_ref();
    if experiments.is_none_or(|e| e.laboratory.is_none()) {
        return Ok(Vec::new());
    }
    let mut notes = bias(&dir.join("laboratory/bias.csv"))?;
    if file.case.specimen.grains.is_some() {
        notes.push(
            "Every virtual specimen has a packing of its own, the surrogate has one. By how much \
             that one differs from their mean, in slope and peak, the calibrated parameters take \
             up (the viscosity with the third power of the displacement at peak), and no interval \
             includes it: calibrate on several packings to see it."
                .to_owned(),
        );
    }
    Ok(notes)
}

/// What the coarse mesh of the surrogate does, where the virtual laboratory had a finer one.
fn bias(path: &Path) -> Result<Vec<String>, WorkflowError> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let table = CsvTable::read(path, &["quantity", "surrogate_mesh", "laboratory_mesh"])?;
    let mesh = table.named("quantity", "spacing_mm")?;
    let mut parts = Vec::new();
    for (name, label) in Qois::NAMES.into_iter().zip(QOI_LABELS) {
        let percent = table.named("quantity", name)?.number("percent_bias")?;
        parts.push(format!("{label} {percent:+.1} %"));
    }
    Ok(vec![format!(
        "The virtual specimens were meshed at {} mm, the surrogate's at {} mm. At the true \
         parameters the coarser mesh changes: {}. The calibrated parameters make up for that.",
        mesh.text("laboratory_mesh"),
        mesh.text("surrogate_mesh"),
        parts.join(", ")
    )])
}

fn settings(file: &CaseFile) -> Vec<(String, String)> {
    let (case, sampler) = (&file.case, &file.case.calibration);
    let row = |name: &str, value: String| (name.to_owned(), value);
    vec![
        row("design", format!("{} runs, seed {}", case.design.runs, case.design.seed)),
        row(
            "sampler",
            format!(
                "NUTS, {} chains of {} + {} draws, seed {}",
                sampler.chains, sampler.warmup, sampler.draws, sampler.seed
            ),
        ),
        row("likelihood", "multivariate normal QoIs, LKJ(3), scales Normal(0.15, 0.25) > 0".into()),
        row("program", format!("breccia {}", env!("CARGO_PKG_VERSION"))),
        row(
            "method",
            "Schmid et al., phase-field calibration with uncertainty quantification".into(),
        ),
    ]
}
