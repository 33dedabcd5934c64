//! Quality of a fit: data without relaxation, and fits that do not describe the data.

use std::path::Path;

use super::data::MeasuredModuli;
use super::fit::PronyFit;
use crate::error::InputError;

/// Mean relative error of a fit above which a warning is given.
const LARGE_ERROR: f64 = 0.05;
/// Deviation from a constant modulus that needs no explanation by noise.
const EXACT: f64 = 1e-3;
/// Deviation from a constant modulus that noise explains, in standard deviations of the noise.
const BY_NOISE: f64 = 2.0;

/// Checks that the series of `fit` describes the data. `table` is the file of the data, for messages. Returns a warning if
/// the mean relative error exceeds 5 %.
///
/// # Errors
/// If the series has no terms although the modulus is not constant within its noise: no series of decaying terms
/// describes the data, e.g. a modulus that increases with time.
pub fn check_fit(
    fit: &PronyFit,
    data: &MeasuredModuli,
    table: &Path,
) -> Result<Option<String>, InputError> {
    let percent = 100.0 * fit.relative_error;
    let noise = data.noise();
    if fit.series.terms.is_empty() && fit.relative_error > EXACT.max(BY_NOISE * noise) {
        let (problem, help) = match data {
            MeasuredModuli::Relaxation(rows) if increases(rows) => (
                "has a modulus that increases with time, which no Prony series describes",
                "Divide the stress by the constant strain, subtract the offset of the force, and leave out readings \
                     before the strain is constant.",
            ),
            MeasuredModuli::Relaxation(_) => (
                "has a modulus that is not constant, but no relaxing term describes it",
                "Check the columns time_s (since the step of the strain) and modulus_mpa, and leave out readings before \
                     the strain is constant.",
            ),
            MeasuredModuli::Dynamic(_) => (
                "has a loss modulus, but no relaxing term describes storage and loss modulus together",
                "Check that storage_mpa and loss_mpa are not exchanged, that both are in MPa, and the unit of the \
                     frequency: frequency_hz, or angular_frequency_per_s.",
            ),
        };
        let problem = format!("{problem} (deviation of a constant {percent:.1} %)");
        return Err(InputError::new(table, "", "", problem, help));
    }
    Ok((fit.relative_error > LARGE_ERROR).then(|| {
        format!(
            "the series differs from the data by {percent:.1} % in the mean: look at the figure. Check units and \
             columns, readings before the strain was constant, readings of another temperature, and noise"
        )
    }))
}

/// Whether the modulus increases with time: the correlation between the logarithms of time and modulus is positive.
fn increases(rows: &[[f64; 2]]) -> bool {
    let mean = |k: usize| rows.iter().map(|row| row[k].ln()).sum::<f64>() / rows.len() as f64;
    let (time, modulus) = (mean(0), mean(1));
    rows.iter().map(|row| (row[0].ln() - time) * (row[1].ln() - modulus)).sum::<f64>() > 0.0
}
