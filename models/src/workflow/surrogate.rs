//! Stage `surrogate`: polynomial chaos from the finished runs.

use surrogate::{Dataset, DynPce, FitOptions, Input, OrderReport, PceFit, SurrogateError};

use super::WorkflowError;
use super::inputs::Inputs;
use super::stiffness::STIFFNESS_RATIO;
use super::task::Task;
use crate::error::InputError;
use crate::table::CsvTable;

pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let runs = Dataset::read_csv(task.inputs.file("runs.csv")?)?;
    let (data, fit) = fitted(&task.inputs, runs)?;
    task.write_csv(
        "surrogate_orders.csv",
        ["order", "terms", "qoi", "loo", "corrected_loo", "train", "validation"],
        orders_table(&fit.report.orders, data.outputs()),
    )?;
    task.write_json("surrogate_error.json", &fit.report)?;
    task.write_json("surrogate.json", &fit.pce)?;
    let error = fit.report.chosen().and_then(|o| o.loo.as_ref()).map_or_else(String::new, |loo| {
        let fractions: Vec<String> =
            loo.corrected.iter().map(|e| format!("{:.2} %", 100.0 * e)).collect();
        format!(", leave-one-out error {} of the variance", fractions.join(", "))
    });
    Ok(format!("order {} from {} runs{error}", fit.report.order, data.len()))
}

/// The expansion as the case wants it, of runs with the stiffness ratio as an input where that of each
/// specimen is known; and what it was fitted to.
pub(super) fn fitted(
    inputs: &Inputs<'_>,
    runs: Dataset,
) -> Result<(Dataset, PceFit), WorkflowError> {
    let known = known_of_specimens(inputs)?;
    let with_stiffness = known.map(|known| with_stiffness_ratio(&runs, &known)).transpose()?;
    let data = with_stiffness.flatten().unwrap_or(runs);
    let case = inputs.surrogate();
    let options = FitOptions {
        max_order: case.max_order,
        rule: case.rule,
        terms: case.terms,
        ..FitOptions::default()
    };
    let fit = DynPce::fit(&data, &options)?;
    Ok((data, fit))
}

/// The stiffness ratios of the specimens, if that of each is known.
fn known_of_specimens(inputs: &Inputs<'_>) -> Result<Option<Vec<f64>>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &["id"])?;
    if table.rows().any(|row| row.text(STIFFNESS_RATIO).is_empty()) {
        return Ok(None);
    }
    let ratios = table.rows().map(|row| row.positive(STIFFNESS_RATIO));
    Ok(Some(ratios.collect::<Result<_, InputError>>()?))
}

/// The runs with the stiffness ratio of the packing of each as one more input, over the range of runs
/// and specimens; none if a run has none.
pub(super) fn with_stiffness_ratio(
    runs: &Dataset,
    specimens: &[f64],
) -> Result<Option<Dataset>, SurrogateError> {
    let ratio = |i: usize| runs.note(i, STIFFNESS_RATIO)?.parse::<f64>().ok();
    let Some(ratios) = (0..runs.len()).map(ratio).collect::<Option<Vec<f64>>>() else {
        return Ok(None);
    };
    let all = || ratios.iter().chain(specimens).copied();
    let (low, high) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let mut inputs = runs.inputs().to_vec();
    inputs.push(Input::new(STIFFNESS_RATIO, low, high)?);
    // derivatives, where there are some, are those at a given ratio
    let differentiated = runs.inputs_with_derivatives();
    let mut data = Dataset::new(inputs, runs.outputs().to_vec(), runs.provenance())?
        .with_derivatives_in(differentiated)?;
    for (i, ((x, y), ratio)) in runs.rows().zip(&ratios).enumerate() {
        let x = [x, &[*ratio]].concat();
        match runs.derivatives(i) {
            None => data.push(&x, y)?,
            Some(slopes) => {
                let jacobian: Vec<&[f64]> = slopes.chunks(differentiated).collect();
                data.push_differentiated(&x, y, &jacobian, &[])?;
            }
        }
    }
    Ok(Some(data))
}

/// Errors of every order and quantity, as fractions of the quantity's variance over the design.
fn orders_table(orders: &[OrderReport], outputs: &[String]) -> Vec<[String; 7]> {
    let cell = |error: Option<&Vec<f64>>, m: usize| {
        error.map_or_else(String::new, |values| values[m].to_string())
    };
    let row = |o: &OrderReport, m: usize| {
        let (loo, split) = (o.loo.as_ref(), o.split.as_ref());
        [
            o.order.to_string(),
            o.terms.to_string(),
            outputs[m].clone(),
            cell(loo.map(|e| &e.plain), m),
            cell(loo.map(|e| &e.corrected), m),
            cell(split.map(|e| &e.train), m),
            cell(split.map(|e| &e.validation), m),
        ]
    };
    orders.iter().flat_map(|o| (0..outputs.len()).map(move |m| row(o, m))).collect()
}
