//! Stage `surrogate`: fits a polynomial chaos expansion to the finished runs.

use surrogate::{Dataset, OrderReport};

use crate::forward::fitted::Fitted;
use crate::forward::specimen_stiffness::of_specimens;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Probability of the intervals in `sobol.csv`, and seed of the draws from which they are computed.
const PROBABILITY: f64 = 0.9;
const SEED: u64 = 1;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let runs = Dataset::read_csv(task.inputs.file("runs.csv")?)?;
    let specimens = of_specimens(&task.inputs)?;
    let fit = Fitted::of(&runs, &specimens, task.inputs.surrogate(), Vec::new())?;
    task.write_csv(
        "surrogate_orders.csv",
        ["order", "terms", "qoi", "loo", "corrected_loo", "train", "validation"],
        orders_table(&fit.report.orders, runs.outputs()),
    )?;
    write_sobol(task, &fit)?;
    task.write_json("surrogate_error.json", &fit.report)?;
    task.write_json("surrogate_uncertainty.json", &fit.coefficients)?;
    if let Some(specimens) = &fit.specimens {
        task.write_json("surrogate_specimens.json", specimens)?;
    }
    task.write_json("surrogate.json", &fit.pce)?;
    let error = fit.report.chosen().and_then(|o| o.loo.as_ref()).map_or_else(String::new, |loo| {
        let fractions: Vec<String> =
            loo.corrected.iter().map(|e| format!("{:.2} %", 100.0 * e)).collect();
        format!(", leave-one-out error {} of the variance", fractions.join(", "))
    });
    Ok(format!("order {} from {} runs{error}", fit.report.order, runs.len()))
}

/// Writes `sobol.csv`: for each quantity and input the first-order and the total Sobol index, each with the ends of its
/// 90 % interval. The ends are empty if there are too few runs.
fn write_sobol(task: &Task<'_>, fit: &Fitted) -> Result<(), WorkflowError> {
    let indices = fit.pce.sobol();
    let intervals = fit.coefficients.sobol_intervals(PROBABILITY, SEED).ok();
    let mut rows = Vec::new();
    for (m, quantity) in fit.pce.outputs().iter().enumerate() {
        for (i, input) in fit.pce.inputs().iter().enumerate() {
            let ends = intervals.as_ref().map(|ends| [ends.first[m][i], ends.total[m][i]]);
            let cells = [indices.first[m][i], indices.total[m][i]].into_iter().enumerate();
            let cells = cells.flat_map(|(kind, index)| {
                let end =
                    |e: usize| ends.map_or_else(String::new, |ends| ends[kind][e].to_string());
                [index.to_string(), end(0), end(1)]
            });
            rows.push([quantity.clone(), input.name.clone()].into_iter().chain(cells).collect());
        }
    }
    let header =
        ["qoi", "input", "first", "first_q05", "first_q95", "total", "total_q05", "total_q95"];
    task.write_csv::<_, Vec<String>>("sobol.csv", header, rows)
}

/// Rows of `surrogate_orders.csv`: errors for every order and quantity, as fractions of the variance of the quantity
/// over the design.
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
