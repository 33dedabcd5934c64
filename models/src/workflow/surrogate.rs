//! Stage `surrogate`: polynomial chaos from the finished runs.

use serde::de::DeserializeOwned;
use surrogate::{Dataset, FitOptions, FitReport, OrderReport, Pce};

use super::ensemble::{read_runs, surrogate_inputs};
use super::files::{csv_text, write};
use super::fingerprint::Fingerprint;
use super::{Stage, Workflow, WorkflowError};
use crate::qoi::Qois;

pub(super) fn inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    Ok(Fingerprint::new()
        .file(&w.needed("runs.csv", Stage::Ensemble)?)?
        .part(&w.case().surrogate)
        .part(&w.case().prior))
}

pub(super) fn run(w: &Workflow) -> Result<String, WorkflowError> {
    let runs = read_runs(&w.path("runs.csv"))?;
    let outputs = Qois::NAMES.map(str::to_owned).to_vec();
    let mut data =
        Dataset::new(surrogate_inputs(w.prior()?)?, outputs, "breccia ensemble: runs.csv")?;
    for (x, y) in &runs {
        data.push(x, y)?;
    }
    let case = &w.case().surrogate;
    let options =
        FitOptions { max_order: case.max_order, rule: case.rule, ..FitOptions::default() };
    let fit = Pce::<3, 3>::fit(&data, &options)?;
    let json = |value: serde_json::Result<String>| {
        value.expect("a fit is plain data with text keys") + "\n"
    };
    write(&w.path("surrogate_orders.csv"), &orders_table(&fit.report.orders))?;
    write(&w.path("surrogate_error.json"), &json(serde_json::to_string_pretty(&fit.report)))?;
    write(&w.path(Stage::Surrogate.product()), &json(serde_json::to_string_pretty(&fit.pce)))?;
    let chosen = fit.report.orders.iter().find(|o| o.order == fit.report.order);
    let error = chosen.and_then(|o| o.loo.as_ref()).map_or_else(String::new, |loo| {
        let shares: Vec<String> =
            loo.corrected.iter().map(|e| format!("{:.2} %", 100.0 * e)).collect();
        format!(", leave-one-out error {} of the variance", shares.join(", "))
    });
    Ok(format!("order {} from {} runs{error}", fit.report.order, runs.len()))
}

/// Errors of every order and quantity, as shares of the quantity's variance over the design.
fn orders_table(orders: &[OrderReport]) -> String {
    let cell = |error: Option<&Vec<f64>>, m: usize| {
        error.map_or_else(String::new, |values| values[m].to_string())
    };
    let rows = orders.iter().flat_map(|o| {
        (0..Qois::NAMES.len()).map(move |m| {
            let (loo, split) = (o.loo.as_ref(), o.split.as_ref());
            [
                o.order.to_string(),
                o.terms.to_string(),
                Qois::NAMES[m].to_owned(),
                cell(loo.map(|e| &e.plain), m),
                cell(loo.map(|e| &e.corrected), m),
                cell(split.map(|e| &e.train), m),
                cell(split.map(|e| &e.validation), m),
            ]
        })
    });
    csv_text("order,terms,qoi,loo,corrected_loo,train,validation", rows)
}

/// Reads `surrogate.json` and checks that it is a surrogate of this calibration.
pub(super) fn read_surrogate(w: &Workflow) -> Result<Pce<3, 3>, WorkflowError> {
    let pce: Pce<3, 3> = read_json(w, "surrogate.json")?;
    let expected = surrogate_inputs(w.prior()?)?;
    if pce.inputs()[..] != expected[..] || pce.outputs()[..] != Qois::NAMES {
        return Err(WorkflowError::File {
            path: w.path("surrogate.json"),
            message: "is of other inputs or outputs than the case; run `breccia surrogate` again"
                .into(),
        });
    }
    Ok(pce)
}

/// Reads `surrogate_error.json`.
pub(super) fn read_error(w: &Workflow) -> Result<FitReport, WorkflowError> {
    read_json(w, "surrogate_error.json")
}

fn read_json<T: DeserializeOwned>(w: &Workflow, name: &str) -> Result<T, WorkflowError> {
    let path = w.needed(name, Stage::Surrogate)?;
    let text = std::fs::read_to_string(&path).map_err(|e| WorkflowError::io(&path, &e))?;
    serde_json::from_str(&text).map_err(|e| WorkflowError::File {
        path,
        message: format!("{e}; run `breccia surrogate` again"),
    })
}
