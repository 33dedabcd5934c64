//! The numbers of a report, from the files that the stages left.

use std::path::Path;

use fem::read_curve;
use surrogate::{Dataset, DynPce, FitReport, OrderRule};

use super::super::WorkflowError;
use super::super::inputs::Inputs;
use super::levels::corrected;
use crate::case::{Case, MaterialParameter, Microstructure, PriorBounds, Toe};
use crate::error::InputError;
use crate::qoi::Quantity;
use crate::report::{
    CalibratedParameter, OrderErrors, Picture, PictureContent, Points, Qoi, Results, mean, number,
};
use crate::table::{CsvTable, TableRow};

/// Reads the results.
pub(super) fn load(inputs: &Inputs<'_>) -> Result<Results, WorkflowError> {
    let case = inputs.case();
    let pce: DynPce = inputs.json("surrogate.json")?;
    let fit: FitReport = inputs.json("surrogate_error.json")?;
    let data = Dataset::read_csv(inputs.file("runs.csv")?)?;
    let mut results = Results {
        title: title(case),
        case_toml: case.to_toml(),
        pictures: pictures(inputs)?,
        image_facts: image_facts(inputs)?,
        mesh_facts: facts(&inputs.file("mesh.csv")?)?,
        map_curve: curve(inputs, "curves/map.csv")?,
        orders: orders(&fit),
        chosen_order: fit.order,
        known_inputs: known_inputs(&pce, case),
        order_rule: rule_in_words(case.surrogate.rule),
        parameters: parameters(inputs, case)?,
        summary: summary(inputs)?,
        warnings: inputs.text("warnings.txt")?.lines().map(str::to_owned).collect(),
        settings: settings(case),
        notes: notes(inputs, case)?,
        qois: qois(inputs, &case.qoi.quantities, &data)?,
        ..Results::default()
    };
    for (qoi, total) in results.qois.iter_mut().zip(pce.sobol().total) {
        qoi.sobol_total = total;
    }
    results.notes.extend(mesh_errors(inputs, &case.qoi.quantities)?);
    results.notes.extend(budget(inputs)?);
    ensemble(inputs, &data, &mut results)?;
    corrected(inputs, &case.qoi.quantities, &data, &mut results)?;
    experiments(inputs, &mut results)?;
    for k in 1..=case.confirm.draws {
        results.posterior_curves.push(curve(inputs, &format!("curves/draw-{k}.csv"))?);
    }
    Ok(results)
}

fn title(case: &Case) -> String {
    let mut regions: Vec<&str> =
        case.prior.iter().flat_map(|prior| prior.parameters()).map(|p| p.region.as_str()).collect();
    regions.dedup();
    let regions = regions.join(" and the ");
    let experiments = case.experiments.as_ref();
    match experiments.and_then(|e| e.virtual_specimens.as_ref()) {
        Some(v) => {
            format!("Calibration of the {regions}: {} virtual specimens {}", v.specimens, v.group)
        }
        None => match experiments.and_then(|e| e.group.as_deref()) {
            Some(group) => format!("Calibration of the {regions}: specimens {group}"),
            None => format!("Calibration of the {regions}"),
        },
    }
}

/// Inputs of the surrogate that are not calibrated.
fn known_inputs(pce: &DynPce, case: &Case) -> Vec<String> {
    let calibrated = case.prior.as_ref().map_or(0, |prior| prior.parameters().len());
    pce.inputs().iter().skip(calibrated).map(|input| input.name.replace('_', " ")).collect()
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

fn curve(inputs: &Inputs<'_>, name: &str) -> Result<Points, WorkflowError> {
    let points = read_curve(inputs.file(name)?)?;
    // a recorded curve starts with its first step
    Ok([(0.0, 0.0)]
        .into_iter()
        .chain(points.iter().map(|p| (p.displacement_mm, p.force_n)))
        .collect())
}

/// The summary table, header first, numbers shortened.
fn summary(inputs: &Inputs<'_>) -> Result<Vec<Vec<String>>, WorkflowError> {
    let short = |cell: &String| cell.parse().map_or_else(|_| cell.clone(), number);
    let path = inputs.file("summary.csv")?;
    let table = CsvTable::read(&path, &["rhat"])?;
    let mut lines = vec![table.columns().to_vec()];
    lines.extend(table.rows().map(|row| row.cells().iter().map(short).collect()));
    Ok(lines)
}

/// What the stages `segment` and `mesh` drew, as far as they did.
fn pictures(inputs: &Inputs<'_>) -> Result<Vec<Picture>, WorkflowError> {
    let files = [
        (
            "slices.png",
            "Slices through the middle of the image with the outlines of the grains found.",
        ),
        ("grains.png", "The grains that were found."),
        ("grain_sizes.svg", "Sizes of the grains."),
        ("mesh.png", "The mesh with a sector of the matrix cut away."),
        (
            "mesh_quality.svg",
            "Shape of the tetrahedra: 70.5° is the best, below 10° computing suffers.",
        ),
    ];
    let mut pictures = Vec::new();
    for (name, caption) in files {
        let Some(path) = inputs.file_if_there(name) else { continue };
        let content = match name.ends_with(".svg") {
            true => std::fs::read_to_string(&path).map(PictureContent::Svg),
            false => std::fs::read(&path).map(PictureContent::Png),
        };
        let content = content.map_err(|e| WorkflowError::io(&path, e))?;
        pictures.push(Picture { caption, content });
    }
    Ok(pictures)
}

fn image_facts(inputs: &Inputs<'_>) -> Result<Vec<(String, String)>, WorkflowError> {
    inputs.file_if_there("segment.csv").map_or(Ok(Vec::new()), |path| facts(&path))
}

fn facts(path: &Path) -> Result<Vec<(String, String)>, WorkflowError> {
    let table = CsvTable::read(path, &["quantity", "value"])?;
    let fact = |row: TableRow| {
        let value = row.number("value")?;
        let whole = value.fract() == 0.0 && value.abs() < 1e15;
        let shown = if whole { value.to_string() } else { number(value) };
        Ok((row.text("quantity").replace('_', " "), shown))
    };
    Ok(table.rows().map(fact).collect::<Result<_, InputError>>()?)
}

/// Errors by order, averaged over the quantities.
fn orders(fit: &FitReport) -> Vec<OrderErrors> {
    fit.orders
        .iter()
        .map(|o| OrderErrors {
            order: o.order,
            loo: o.loo.as_ref().map(|e| mean(&e.plain)),
            corrected: o.loo.as_ref().map(|e| mean(&e.corrected)),
            training: o.split.as_ref().map(|e| mean(&e.train)),
            validation: o.split.as_ref().map(|e| mean(&e.validation)),
        })
        .collect()
}

fn parameters(inputs: &Inputs<'_>, case: &Case) -> Result<Vec<CalibratedParameter>, WorkflowError> {
    let Some(prior) = &case.prior else { return Ok(Vec::new()) };
    let [draws, summary, map] = ["posterior.csv", "summary.csv", "map.csv"].map(|f| inputs.file(f));
    let (draws, summary, map) = (draws?, summary?, map?);
    let names: Vec<String> = ["chain".to_owned()].into_iter().chain(prior.names()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let draws = CsvTable::read(&draws, &names)?;
    let summary = CsvTable::read(&summary, &["parameter", "mean", "sd", "contraction"])?;
    let map = CsvTable::read(&map, &["parameter", "map"])?;
    let one_region = |p: &MaterialParameter| prior.parameters().all(|q| q.region == p.region);
    let out_of_range = is_out_of_range(inputs)?;
    let mut parameters = Vec::new();
    for ((parameter, &PriorBounds([lower, upper])), name) in prior.iter().zip(&names[1..]) {
        let mut chains: Vec<Vec<f64>> = Vec::new();
        for row in draws.rows() {
            let chain = row.number("chain")?;
            if !(0.0..case.calibration.chains as f64).contains(&chain) || chain.fract() != 0.0 {
                let help = "Run `breccia calibrate` again.";
                return Err(row.error("chain", "is no chain of this case", help).into());
            }
            let chain = chain as usize;
            chains.resize_with(chains.len().max(chain + 1), Vec::new);
            chains[chain].push(row.number(name)?);
        }
        let of = |table: &CsvTable<'_>, column: &str| -> Result<f64, InputError> {
            table.named("parameter", name)?.number(column)
        };
        parameters.push(CalibratedParameter {
            label: parameter.label(one_region(parameter)),
            prior: (lower, upper),
            chains,
            mean: of(&summary, "mean")?,
            sd: of(&summary, "sd")?,
            q05: of(&summary, "q05")?,
            q95: of(&summary, "q95")?,
            contraction: of(&summary, "contraction")?,
            map: of(&map, "map")?,
            truth: map.named("parameter", name)?.text("truth").parse().ok(),
            out_of_range,
        });
    }
    Ok(parameters)
}

/// Whether the calibration went on against data that no simulation reaches.
fn is_out_of_range(inputs: &Inputs<'_>) -> Result<bool, WorkflowError> {
    let path = inputs.file("range.csv")?;
    let table = CsvTable::read(&path, &["inside"])?;
    Ok(table.rows().any(|row| row.text("inside") != "true"))
}

fn qois(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    data: &Dataset,
) -> Result<Vec<Qoi>, WorkflowError> {
    let (confirm, experiments) = (inputs.file("confirm.csv")?, inputs.file("experiments.csv")?);
    let confirm = CsvTable::read(&confirm, &["qoi", "map_simulation", "percent_error"])?;
    let columns: Vec<&str> = quantities.iter().map(|quantity| quantity.column()).collect();
    let experiments = CsvTable::read(&experiments, &columns)?;
    let mut qois = Vec::new();
    for (m, quantity) in quantities.iter().enumerate() {
        let name = quantity.column();
        let row = confirm.named("qoi", name)?;
        qois.push(Qoi {
            label: quantity.label().to_owned(),
            experiments: experiments.rows().map(|r| r.number(name)).collect::<Result<_, _>>()?,
            ensemble: data.rows().map(|(_, y)| y[m]).collect(),
            map: row.number("map_simulation")?,
            percent_error: row.number("percent_error")?,
            sobol_total: Vec::new(),
        });
    }
    Ok(qois)
}

fn ensemble(
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
fn experiments(inputs: &Inputs<'_>, results: &mut Results) -> Result<(), WorkflowError> {
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

/// What belongs to the reading of results on virtual specimens.
fn notes(inputs: &Inputs<'_>, case: &Case) -> Result<Vec<String>, WorkflowError> {
    if !inputs.are_specimens_virtual()? {
        return Ok(Vec::new());
    }
    let mut notes = bias(inputs, &case.qoi.quantities)?;
    if case.specimen.grains.is_some() && case.design.microstructure == Microstructure::One {
        notes.push(
            "Every virtual specimen has a packing of its own, the surrogate has one. By how much \
             that one differs from their mean, in slope and peak, the calibrated parameters take \
             up (the viscosity with the third power of the displacement at peak), and no interval \
             includes it: design.microstructure = \"per-run\" makes it seen."
                .to_owned(),
        );
    }
    Ok(notes)
}

/// What the mesh is estimated to do at the mode, where that is known.
fn mesh_errors(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
) -> Result<Option<String>, WorkflowError> {
    let path = inputs.file("confirm.csv")?;
    let table = CsvTable::read(&path, &["qoi", "mesh_error_percent"])?;
    let mut parts = Vec::new();
    for quantity in quantities {
        let row = table.named("qoi", quantity.column())?;
        let Ok(percent) = row.text("mesh_error_percent").parse::<f64>() else { return Ok(None) };
        parts.push(format!("{} {percent:+.1} %", quantity.label()));
    }
    Ok(Some(format!(
        "Error of the mesh at the mode, estimated from a second one with another spacing: {}. No \
         interval holds it.",
        parts.join(", ")
    )))
}

/// What widens the interval of each parameter.
fn budget(inputs: &Inputs<'_>) -> Result<Vec<String>, WorkflowError> {
    let Some(path) = inputs.file_if_there("uncertainty.csv") else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &["parameter", "source", "share"])?;
    let mut lines: Vec<(String, Vec<String>)> = Vec::new();
    for row in table.rows() {
        let part = format!("{} {:.0} %", row.text("source"), 100.0 * row.number("share")?);
        match lines.last_mut() {
            Some((parameter, parts)) if parameter == row.text("parameter") => parts.push(part),
            _ => lines.push((row.text("parameter").to_owned(), vec![part])),
        }
    }
    let line = |(parameter, parts): (String, Vec<String>)| {
        format!("What widens the interval of {parameter}, beside its prior: {}.", parts.join(", "))
    };
    Ok(lines.into_iter().map(line).collect())
}

/// What the coarse mesh of the surrogate does, where the virtual specimens had a finer one.
fn bias(inputs: &Inputs<'_>, quantities: &[Quantity]) -> Result<Vec<String>, WorkflowError> {
    let Some(path) = inputs.file_if_there("experiments/bias.csv") else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &["quantity", "surrogate_mesh", "experiments_mesh"])?;
    let mesh = table.named("quantity", "spacing_mm")?;
    let mut parts = Vec::new();
    for quantity in quantities {
        let percent = table.named("quantity", quantity.column())?.number("percent_bias")?;
        parts.push(format!("{} {percent:+.1} %", quantity.label()));
    }
    Ok(vec![format!(
        "The virtual specimens were meshed at {} mm, the surrogate's at {} mm. At the true \
         parameters the coarser mesh changes: {}. The calibrated parameters make up for that.",
        mesh.text("experiments_mesh"),
        mesh.text("surrogate_mesh"),
        parts.join(", ")
    )])
}

fn settings(case: &Case) -> Vec<(String, String)> {
    let sampler = &case.calibration;
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
        row("likelihood", "multivariate normal QoIs, LKJ(3), scales Normal(0.15, 0.25) > 0; one error of the surrogate \
             shared by all specimens"
                .into()),
        row("program", format!("breccia {}", env!("CARGO_PKG_VERSION"))),
        row(
            "method",
            "Schmid et al., phase-field calibration with uncertainty quantification".into(),
        ),
    ]
}
