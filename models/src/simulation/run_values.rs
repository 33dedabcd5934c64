//! Quantities of interest of a finished run, their derivatives, or the reason why the run has none.

use std::iter;

use fem::{End, FemError, RunEnd, RunRecord, RunStatus};

use super::recorded::recorded_run;
use crate::case::QoiComparison;
use crate::qoi::{Extent, Qois, Quantity};

/// Returns the error of a failed run.
pub(crate) fn failure(end: &End) -> Option<FemError> {
    match end {
        End::Failed(error) => Some(error.clone()),
        End::Displacement | End::BelowPeak | End::LimitLoad | End::Interrupted => None,
    }
}

/// Quantities of interest of a run, or the reason why the run has no quantities.
pub(crate) fn quantities(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<f64>, String> {
    match &record.status {
        RunStatus::Failed(reason) => Err(format!("failed: {reason}")),
        RunStatus::Finished if record.curve.is_empty() => reported(record, qoi),
        RunStatus::Finished if record.end == RunEnd::LimitLoad => {
            up_to_limit_load(record, qoi).map_err(|error| format!("unusable: {error}"))
        }
        RunStatus::Finished => {
            Qois::values_of(&recorded_run(record), qoi.slope_fraction, &qoi.quantities)
                .map_err(|error| format!("unusable: {error}"))
        }
    }
}

/// Quantities of a run whose specimen does not carry the force of the load program. The branches of its curve are
/// incomplete, so that quantities of whole branches are not computed.
fn up_to_limit_load(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<f64>, String> {
    let last = record.curve.last().copied().unwrap_or_default();
    let failure = format!(
        "the specimen does not carry the force of test.program and fails after {:.4} s at {:.4} N and {:.4} mm; prescribe \
         a smaller force, or the displacement",
        last.time_s, last.force_n, last.displacement_mm
    );
    let is_of_branch = |quantity: &&Quantity| {
        matches!(quantity.extent(), Extent::Hold | Extent::ForceHold | Extent::Unloading)
    };
    if let Some(quantity) = qoi.quantities.iter().find(is_of_branch) {
        return Err(format!("{failure} ({quantity} needs the whole program)"));
    }
    Qois::values_of(&recorded_run(record), qoi.slope_fraction, &qoi.quantities)
        .map_err(|error| format!("{failure} ({error})"))
}

/// Quantities that a run without a curve reports by name.
fn reported(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<f64>, String> {
    let value = |quantity: &Quantity| {
        let column = quantity.column();
        record.values.get(&*column).copied().ok_or_else(|| {
            let names: Vec<&str> = record.values.keys().map(String::as_str).collect();
            format!("unusable: there is no {column} among the results {}", names.join(", "))
        })
    };
    qoi.quantities.iter().map(value).collect()
}

/// Derivatives of the quantities of interest with respect to the parameters of the force derivatives (quantities ×
/// parameters), or the reason why the run has no derivatives.
pub(crate) fn jacobian(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<Vec<f64>>, String> {
    let (curve, derivatives) = (recorded_run(record), &record.sensitivities);
    if derivatives.force_n.len() < record.curve.len() {
        return Err(format!(
            "without derivatives from {} mm on: {}",
            record.curve[derivatives.force_n.len()].displacement_mm,
            derivatives.lost.as_deref().unwrap_or("the run was made by another version")
        ));
    }
    let column = |parameter: usize| {
        // the force at the unloaded start does not depend on the parameters
        let rates = derivatives.force_n.iter().map(|row| row[parameter]);
        let rates: Vec<f64> = iter::once(0.0).chain(rates).collect();
        let moved = derivatives.displacement_mm.iter().map(|row| row[parameter]);
        let moved: Vec<f64> = match derivatives.displacement_mm.is_empty() {
            true => Vec::new(),
            false => iter::once(0.0).chain(moved).collect(),
        };
        Qois::rates_along(&curve, qoi.slope_fraction, &qoi.quantities, &rates, &moved)
            .map_err(|error| format!("without derivatives: {error}"))
    };
    let columns = (0..derivatives.names.len()).map(column).collect::<Result<Vec<_>, _>>()?;
    let row = |quantity: usize| columns.iter().map(|column| column[quantity]).collect();
    Ok((0..qoi.quantities.len()).map(row).collect())
}
