//! Stage `surrogate`: polynomial chaos from the finished runs.

use surrogate::{Dataset, DynPce, FitOptions, OrderReport};

use super::WorkflowError;
use super::task::Task;

pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let data = Dataset::read_csv(task.inputs.file("runs.csv")?)?;
    let case = task.inputs.surrogate();
    let options =
        FitOptions { max_order: case.max_order, rule: case.rule, ..FitOptions::default() };
    let fit = DynPce::fit(&data, &options)?;
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
