//! Stage `surrogate`: polynomial chaos from the finished runs.

use surrogate::{Dataset, DynPce, FitOptions, OrderReport, PceFit};

use super::WorkflowError;
use super::inputs::Inputs;
use super::specimen_stiffness::{of_specimens, population, with_stiffness_ratio};
use super::task::Task;
use crate::case::SurrogateCase;

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

/// The expansion as the case wants it, of runs with the stiffness ratio as an input where it is known of
/// specimens; and what it was fitted to.
pub(super) fn fitted(
    inputs: &Inputs<'_>,
    runs: Dataset,
) -> Result<(Dataset, PceFit), WorkflowError> {
    let data = knowing_stiffness(inputs, &runs)?.unwrap_or(runs);
    let fit = DynPce::fit(&data, &fit_options(inputs.surrogate()))?;
    Ok((data, fit))
}

/// How the case wants surrogates to be fitted.
pub(super) fn fit_options(case: &SurrogateCase) -> FitOptions {
    let SurrogateCase { max_order, rule, terms } = *case;
    FitOptions { max_order, rule, terms, ..FitOptions::default() }
}

/// The runs with the stiffness ratio as an input, where it is known of each specimen, or of some while a population
/// tells of the others. Where it is known of none it stays out: the scatter of packings is then in the residuals of
/// the surrogate and in that of the specimens.
fn knowing_stiffness(
    inputs: &Inputs<'_>,
    runs: &Dataset,
) -> Result<Option<Dataset>, WorkflowError> {
    let specimens = of_specimens(inputs)?;
    let known: Vec<f64> = specimens.iter().flatten().copied().collect();
    let population = population(runs, &specimens);
    let are_all_known = known.len() == specimens.len();
    if known.is_empty() || (!are_all_known && population.is_none()) {
        return Ok(None);
    }
    Ok(with_stiffness_ratio(runs, &known, population.as_ref())?)
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
