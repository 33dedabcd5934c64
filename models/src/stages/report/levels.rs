//! Report on the corrections of runs on cheap meshes.

use std::collections::BTreeMap;

use surrogate::Dataset;

use crate::pipeline::inputs::Inputs;
use crate::qoi::{DisplacementAtPeak, PeakForce, Quantity};
use crate::report::Results;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Scales the curves of the ensemble by the correction of their quantities, and adds a note on each correction. Does
/// nothing without `[fidelity]`.
pub(super) fn corrected(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
    data: &Dataset,
    results: &mut Results,
) -> Result<(), WorkflowError> {
    let (Some(runs), Some(ratios)) =
        (inputs.file_if_there("fidelity_runs.csv"), inputs.file_if_there("fidelity.csv"))
    else {
        return Ok(());
    };
    let runs = CsvTable::read(&runs, &["level", "run", "seconds"])?;
    let index = |quantity| quantities.iter().position(|other| *other == quantity);
    let axes = [index(Quantity::new(DisplacementAtPeak)), index(Quantity::new(PeakForce))];
    let mut simulated: BTreeMap<String, [Option<f64>; 2]> = BTreeMap::new();
    for row in runs.rows() {
        if row.text("level") != "1" {
            results.ensemble_seconds += row.number("seconds")?;
            continue;
        }
        let value = |m: Option<usize>| m.and_then(|m| row.number(&quantities[m].column()).ok());
        simulated.insert(row.text("run").to_owned(), axes.map(value));
    }
    for (i, (curve, (_, corrected))) in results.ensemble.iter_mut().zip(data.rows()).enumerate() {
        let values_of_run = data.note(i, "run").and_then(|run| simulated.get(run)).copied();
        let factor = |axis: usize| {
            let raw = values_of_run.and_then(|values| values[axis]);
            axes[axis].zip(raw).map_or(1.0, |(m, raw)| corrected[m] / raw)
        };
        let [along, up] = [factor(0), factor(1)];
        curve.iter_mut().for_each(|(d, force)| (*d, *force) = (*d * along, *force * up));
    }
    let columns = ["level", "qoi", "order", "ratio", "scatter_percent", "error_percent", "runs"];
    let ratios = CsvTable::read(&ratios, &columns)?;
    for row in ratios.rows() {
        let name = Quantity::of_column(row.text("qoi"))
            .map_or_else(|| row.text("qoi").to_owned(), |quantity| quantity.label());
        results.notes.push(format!(
            "Level {} of the meshes: {name} on the next level is {:.3} times as large (from {} runs on both levels, \
             standard error {:.1} %; runs scatter by {:.1} %). The runs are corrected by this ratio, and the figures \
             show the corrected curves.",
            row.text("level"),
            row.number("ratio")?,
            row.text("runs"),
            row.number("error_percent")?,
            row.number("scatter_percent")?
        ));
    }
    Ok(())
}
