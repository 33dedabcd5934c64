//! Notes on the results, as sentences.

use surrogate::Dataset;

use crate::case::Case;
use crate::experiments::experiment_inputs;
use crate::forward::specimen_stiffness::{in_words, of_specimens, population};
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Notes on results with virtual specimens.
pub(super) fn of_virtual_specimens(
    inputs: &Inputs<'_>,
    case: &Case,
) -> Result<Vec<String>, WorkflowError> {
    if !experiment_inputs::are_specimens_virtual(inputs)? {
        return Ok(Vec::new());
    }
    bias(inputs, &case.compared_quantities())
}

/// Note on the estimated error of the mesh at the mode and on whether the intervals include this error; no note if
/// the error was not estimated.
pub(super) fn mesh_errors(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
) -> Result<Option<String>, WorkflowError> {
    let path = inputs.file("confirm.csv")?;
    let table = CsvTable::read(&path, &["qoi", "mesh_error_percent"])?;
    let stated = &inputs.calibration().discrepancy.percent;
    let (mut percentages, mut left_out) = (Vec::new(), Vec::new());
    for quantity in quantities {
        let row = table.named("qoi", &quantity.column())?;
        let Ok(percent) = row.text("mesh_error_percent").parse::<f64>() else { return Ok(None) };
        percentages.push(format!("{} {percent:+.1} %", quantity.label()));
        if stated.get(quantity).is_none_or(|stated| *stated < percent.abs()) {
            left_out.push(quantity.label().to_string());
        }
    }
    let included = match left_out.len() {
        0 => "The intervals include it ([calibration.discrepancy]).".to_owned(),
        n if n == quantities.len() => "No interval includes it.".to_owned(),
        _ => format!("The intervals do not include the error of {}.", left_out.join(", ")),
    };
    Ok(Some(format!(
        "Error of the mesh at the mode, estimated from a second mesh with another spacing: {}. {included}",
        percentages.join(", ")
    )))
}

/// Note on the assumed stiffness ratio of specimens without an image.
pub(super) fn unknown_stiffness(
    inputs: &Inputs<'_>,
    runs: &Dataset,
) -> Result<Option<String>, WorkflowError> {
    let ratios = of_specimens(inputs)?;
    Ok(population(runs, &ratios).and_then(|population| in_words(&ratios, &population)))
}

/// Note on the effect of the damage quadrature; none if two quadratures were not compared.
pub(super) fn quadrature(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
) -> Result<Option<String>, WorkflowError> {
    let Some(path) = inputs.file_if_there("quadrature.csv") else { return Ok(None) };
    let table = CsvTable::read(&path, &["qoi", "percent"])?;
    let mut percentages = Vec::new();
    for quantity in quantities {
        let percent = table.named("qoi", &quantity.column())?.number("percent")?;
        percentages.push(format!("{} {percent:+.1} %", quantity.label()));
    }
    Ok(Some(format!(
        "On a mesh that is coarse for a crack, the result depends on the quadrature of the damage terms. On the cheapest \
         mesh the other quadrature would change: {}. The intervals do not include this difference.",
        percentages.join(", ")
    )))
}

/// Note on the bias of the surrogate's mesh, if the virtual specimens have a finer mesh.
fn bias(inputs: &Inputs<'_>, quantities: &[Quantity]) -> Result<Vec<String>, WorkflowError> {
    let Some(path) = inputs.file_if_there("experiments/bias.csv") else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &["quantity", "surrogate_mesh", "experiments_mesh"])?;
    let mesh = table.named("quantity", "spacing_mm")?;
    let mut percentages = Vec::new();
    for quantity in quantities {
        let percent = table.named("quantity", &quantity.column())?.number("percent_bias")?;
        percentages.push(format!("{} {percent:+.1} %", quantity.label()));
    }
    Ok(vec![format!(
        "The virtual specimens were meshed at {} mm, the surrogate's at {} mm. At the true \
         parameters the coarser mesh changes: {}. The calibrated parameters compensate this.",
        mesh.text("experiments_mesh"),
        mesh.text("surrogate_mesh"),
        percentages.join(", ")
    )])
}
