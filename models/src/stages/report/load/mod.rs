//! Loads the contents of the report from the files of the stages.

mod confirmed;
mod edited;
mod further;
mod measured;
mod notes;
mod posterior;
mod provenance;
mod validated;

use std::collections::BTreeSet;
use std::path::Path;

use surrogate::{Dataset, DynPce, FitReport, OrderRule};

use super::levels::corrected;
use crate::case::{CalibrationCase, Case, Likelihood};
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::{OrderErrors, Picture, PictureContent, Qoi, Qualifier, Results, mean, number};
use crate::results_folder::error::WorkflowError;
use crate::rules::fit;
use crate::rules::warnings::{of_rules, of_stages};
use crate::specimen::images;
use crate::specimen::images::{FIRST, segmented_file};
use crate::table::{CsvTable, TableRow};
pub(crate) use posterior::{divergences, evidence, parameters, sensitivities, summary};

/// Reads the results of all stages.
pub(crate) fn load(inputs: &Inputs<'_>) -> Result<Results, WorkflowError> {
    load_done(inputs, &|_| true)
}

/// Reads the results of the stages for which `done` is true. For an unfinished ensemble, reads the runs that have
/// ended.
pub(crate) fn load_done(
    inputs: &Inputs<'_>,
    done: &dyn Fn(&str) -> bool,
) -> Result<Results, WorkflowError> {
    let case = inputs.case();
    let quantities = &case.compared_quantities();
    let qoi = |quantity: &Quantity| Qoi { label: quantity.label(), ..Qoi::default() };
    let mut results = Results {
        title: title(case),
        case_toml: case.to_toml(),
        provenance: Some(provenance::provenance(inputs)),
        changed_keys: provenance::changed_keys(case),
        methods: Some(provenance::methods(case)),
        settings: settings(case),
        pictures: pictures(inputs, done)?,
        qois: quantities.iter().map(qoi).collect(),
        ..Results::default()
    };
    if done("mesh") && inputs.is_built_in() {
        results.image_facts = image_facts(inputs)?;
        results.mesh_facts = facts(&inputs.file("mesh.csv")?)?;
    }
    if done("ensemble") {
        let data = Dataset::read_csv(inputs.file("runs.csv")?)?;
        measured::ensemble(inputs, &data, &mut results)?;
        corrected(inputs, quantities, &data, &mut results)?;
        if done("calibrate") {
            let label = |name: &str| posterior::label_of(case, name);
            results.parameters = parameters(inputs, &data, &label)?;
        }
        results.notes.extend(notes::quadrature(inputs, quantities)?);
    } else {
        measured::ensemble_so_far(inputs, &mut results);
    }
    if done("experiments") {
        results.findings = measured::findings(inputs)?;
        results.notes.extend(notes::of_virtual_specimens(inputs, case)?);
        measured::experiments(inputs, quantities, &mut results)?;
        confirmed::experiments(inputs, quantities, &mut results.qois)?;
    }
    if done("surrogate") {
        let pce: DynPce = inputs.json("surrogate.json")?;
        let fit: FitReport = inputs.json("surrogate_error.json")?;
        results.orders = orders(&fit);
        results.chosen_order = fit.order;
        results.known_inputs = known_inputs(&pce, case);
        results.order_rule = rule_in_words(case.surrogate.rule);
        let indices = sobol(inputs, quantities)?;
        results.qois.iter_mut().zip(indices).for_each(|(qoi, total)| qoi.sobol_total = total);
    }
    if done("calibrate") {
        results.predicted_curves = confirmed::predicted_curves(inputs)?;
        if !results.known_inputs.is_empty() {
            let data = Dataset::read_csv(inputs.file("runs.csv")?)?;
            results.notes.extend(notes::unknown_stiffness(inputs, &data)?);
        }
        results.budget = posterior::budget(inputs, case)?;
        results.sensitivities =
            posterior::sensitivities(inputs, &|name| posterior::label_of(case, name))?;
        results.evidence = posterior::evidence(inputs)?;
        results.summary = posterior::summary(inputs)?;
        results.divergences = posterior::divergences(inputs)?;
        results.loo = posterior::left_out(inputs, case)?;
        let is_confirmed = done("confirm") && case.design.import.is_none();
        results.misfits = fit::verdicts(inputs, is_confirmed)?;
        confirmed::predictive(inputs, quantities, &mut results.qois)?;
    }
    // imported runs cannot be repeated at the mode
    if done("confirm") && case.design.import.is_none() {
        if case.is_built_in() {
            results.baseline_curve = Some(measured::confirmed(inputs, "baseline")?);
            results.damage = confirmed::damage(inputs)?;
        }
        results.is_confirmed = true;
        results.map_curve = measured::confirmed_if_there(inputs, "map")?;
        results.notes.extend(notes::mesh_errors(inputs, quantities)?);
        confirmed::at_the_mode(inputs, quantities, &mut results.qois)?;
        for k in 1..=case.confirm.draws {
            let draw = measured::confirmed_if_there(inputs, &format!("draw-{k}"))?;
            results.posterior_curves.extend((!draw.is_empty()).then_some(draw));
        }
    }
    if done("validate") {
        results.validations = validated::validations(inputs)?;
        results.validation_coverage = validated::coverage(inputs)?;
    }
    if done("next-test") {
        results.further = further::further(inputs, case)?;
        results.failed_candidates = further::failed(inputs)?;
    }
    results.notes.extend(edited::edited(inputs)?);
    warned(inputs, done, &mut results)?;
    Ok(results)
}

/// Adds the warnings of rules and stages, and the qualifiers that restrict the verdicts on the parameters.
fn warned(
    inputs: &Inputs<'_>,
    done: &dyn Fn(&str) -> bool,
    results: &mut Results,
) -> Result<(), WorkflowError> {
    let of_rules = of_rules(inputs, done)?;
    let qualifiers: BTreeSet<Qualifier> = of_rules.iter().filter_map(|w| w.qualifier).collect();
    results.parameters.iter_mut().for_each(|p| p.qualifiers.clone_from(&qualifiers));
    let all = of_rules.into_iter().chain(of_stages(inputs, done)?);
    results.warnings = all.map(|warning| warning.text).collect();
    Ok(())
}

fn title(case: &Case) -> String {
    let parameters = case.prior.iter().flat_map(|prior| prior.parameters());
    let mut regions: Vec<&str> = parameters.filter_map(|p| p.region()).collect();
    regions.dedup();
    let regions = match regions.is_empty() {
        true if !case.is_built_in() => "model".to_owned(),
        true => "specimen".to_owned(),
        false => regions.join(" and the "),
    };
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

/// Inputs of the surrogate that are not calibrated, because their values are known.
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
        OrderRule::Fixed(order) => format!("the requested order {order}"),
    }
}

/// Advice for the case that outlines of grains are wrong.
const OUTLINES: &str = "if grains are missed, merged or divided, set the thresholds and filters of [specimen.image] \
                        (docs/how-to/images.md).";

/// Pictures that the stages `segment` and `mesh` have written.
fn pictures(
    inputs: &Inputs<'_>,
    done: &dyn Fn(&str) -> bool,
) -> Result<Vec<Picture>, WorkflowError> {
    let standard = [
        (
            "slices.png",
            "Slices through the middle of the image with the outlines of the grains found.",
            OUTLINES,
        ),
        ("grains.png", "The grains that were found.", OUTLINES),
        (
            "grain_sizes.svg",
            "Sizes of the grains.",
            "many tiny grains are noise of the image or parts of divided grains: look at the outlines in the slices.",
        ),
        (
            "mesh.png",
            "The mesh with a sector of the matrix cut away.",
            "grains with steps or holes need a smaller specimen.spacing_mm, or specimen.grain_mode = \"conforming\".",
        ),
        (
            "mesh_quality.svg",
            "Shape of the tetrahedra: 70.5° is the best, below 10° computing suffers.",
            "bars below 10° slow the solver and may stop it: increase specimen.min_dihedral_deg.",
        ),
    ];
    let standard =
        standard.map(|(name, caption, if_wrong)| (name.to_owned(), caption.to_owned(), if_wrong));
    let names = if done("segment") { images::names(inputs)? } else { Vec::new() };
    let further = (FIRST + 1..).zip(names).map(|(image, name)| {
        let caption = format!("Slices through image {image}, {name}, with the grains found.");
        (segmented_file(image, "slices.png"), caption, OUTLINES)
    });
    let mut pictures = Vec::new();
    let is_done = |name: &str| inputs.writer_of(name).is_some_and(done);
    let files = standard.into_iter().chain(further);
    for (name, caption, if_wrong) in files.filter(|(name, ..)| is_done(name)) {
        let Some(path) = inputs.file_if_there(&name) else { continue };
        let content = match name.ends_with(".svg") {
            true => std::fs::read_to_string(&path).map(PictureContent::Svg),
            false => std::fs::read(&path).map(PictureContent::Png),
        };
        let content = content.map_err(|e| WorkflowError::io(&path, e))?;
        pictures.push(Picture { caption, if_wrong, content });
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
        Ok((with_unit(row.text("quantity")), shown))
    };
    Ok(table.rows().map(fact).collect::<Result<_, InputError>>()?)
}

/// Name of a quantity as text, with its unit in brackets.
fn with_unit(name: &str) -> String {
    let units = [("_mm3", " (mm³)"), ("_mm", " (mm)"), ("_deg", " (°)")];
    let (name, unit) = units
        .into_iter()
        .find_map(|(end, unit)| Some((name.strip_suffix(end)?, unit)))
        .unwrap_or((name, ""));
    name.replace('_', " ") + unit
}

/// A Sobol index with the ends of its interval, if there is one.
type SobolIndex = (f64, Option<[f64; 2]>);

/// Total Sobol indices of each quantity, one per input.
fn sobol(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
) -> Result<Vec<Vec<SobolIndex>>, WorkflowError> {
    let path = inputs.file("sobol.csv")?;
    let table = CsvTable::read(&path, &["qoi", "total", "total_q05", "total_q95"])?;
    // the index of an output without variance is empty
    let cell = |row: &TableRow, column| row.text(column).parse::<f64>().ok();
    let index = |row: TableRow| {
        let ends = cell(&row, "total_q05").zip(cell(&row, "total_q95"));
        (cell(&row, "total").unwrap_or(f64::NAN), ends.map(|(low, high)| [low, high]))
    };
    let interval = |quantity: &Quantity| {
        table.rows().filter(|row| row.text("qoi") == quantity.column()).map(index).collect()
    };
    Ok(quantities.iter().map(interval).collect())
}

/// Errors of each polynomial order, averaged over the quantities.
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

fn discrepancy_in_words(calibration: &CalibrationCase) -> String {
    let part = |(quantity, percent): (&Quantity, &f64)| format!("{quantity} {percent} %");
    let percentages: Vec<String> = calibration.discrepancy.percent.iter().map(part).collect();
    if percentages.is_empty() { "none".to_owned() } else { percentages.join(", ") }
}

/// Describes burn-in and thinning; empty if there is neither.
fn left_out(sampler: &CalibrationCase) -> String {
    match (sampler.burn_in, sampler.thin) {
        (0, 1) => String::new(),
        (burn_in, thin) => format!(" (every {thin}th, the first {burn_in} steps left out)"),
    }
}

fn settings(case: &Case) -> Vec<(String, String)> {
    let sampler = &case.calibration;
    let row = |name: &str, value: String| (name.to_owned(), value);
    vec![
        row(
            "design",
            match &case.design.import {
                Some(_) => "imported runs".to_owned(),
                None => format!("{} runs, seed {}", case.design.runs, case.design.seed),
            },
        ),
        row(
            "sampler",
            format!(
                "NUTS, {} chains of {} + {} draws{}, seed {}",
                sampler.chains,
                sampler.warmup,
                sampler.draws,
                left_out(sampler),
                sampler.seed
            ),
        ),
        row(
            "likelihood",
            format!(
                "multivariate normal {}, LKJ(3), scales Normal(0.15, 0.25) > 0; one error of \
                 surrogate and mesh correction shared by all specimens",
                match sampler.likelihood {
                    Likelihood::Quantities => "QoIs",
                    Likelihood::Curve => "curves (peak, its displacement, shape)",
                }
            ),
        ),
        row("discrepancy of the model", discrepancy_in_words(sampler)),
    ]
}
