//! The error of the mesh has to be smaller than what the posterior includes.

use super::super::WorkflowError;
use super::super::inputs::Inputs;
use super::super::rule::{Rule, Warning, qualified};
use crate::qoi::Quantity;
use crate::report::Qualifier;
use crate::table::CsvTable;

/// A smaller error than this is never worth a word, %.
const NEGLIGIBLE: f64 = 2.0;

/// Of each quantity at the mode, as far as it was estimated from a second mesh.
pub(super) const RULE: Rule =
    Rule { reads: &["calibrate", "confirm"], check: |inputs| Ok(warned(&errors(inputs)?)) };

/// An estimated error of the mesh beside what the posterior includes.
#[derive(Clone, Debug)]
struct MeshError {
    quantity: String,
    percent: f64,
    /// Posterior standard deviation of the mean response.
    sd_percent: f64,
}

/// Whether an error moves the result by more than its intervals include.
fn is_large(percent: f64, sd_percent: f64) -> bool {
    percent.abs() > sd_percent.max(NEGLIGIBLE)
}

fn errors(inputs: &Inputs<'_>) -> Result<Vec<MeshError>, WorkflowError> {
    let [confirm, summary] = ["confirm.csv", "summary.csv"].map(|name| inputs.file(name));
    let (confirm, summary) = (confirm?, summary?);
    let confirm = CsvTable::read(&confirm, &["qoi", "mesh_error_percent"])?;
    let summary = CsvTable::read(&summary, &["parameter", "mean", "sd"])?;
    let mut errors = Vec::new();
    for row in confirm.rows() {
        // not estimated of a mesh from a file
        let Ok(percent) = row.text("mesh_error_percent").parse::<f64>() else { continue };
        let Some(quantity) = Quantity::of_column(row.text("qoi")) else { continue };
        let mean = summary.named("parameter", &format!("mean[{}]", quantity.column()))?;
        let sd_percent = (100.0 * mean.number("sd")? / mean.number("mean")?).abs();
        errors.push(MeshError { quantity: quantity.to_string(), percent, sd_percent });
    }
    Ok(errors)
}

fn warned(errors: &[MeshError]) -> Vec<Warning> {
    let large = errors.iter().filter(|error| is_large(error.percent, error.sd_percent));
    let words = |MeshError { quantity, percent, sd_percent }: &MeshError| {
        format!("{quantity} by {percent:+.1} % (posterior sd {sd_percent:.1} %)")
    };
    let words: Vec<String> = large.map(words).collect();
    if words.is_empty() {
        return Vec::new();
    }
    let text = format!(
        "The calibrated values are those on this mesh: it is estimated to change {} at the MAP, which no interval \
         includes. Take a smaller specimen.spacing_mm, for which few runs pay with [fidelity], or quadratic elements.",
        words.join(", ")
    );
    qualified(Qualifier::MeshError, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_large_beyond_the_posterior_and_two_percent() {
        assert!(!is_large(2.49, 2.5) && is_large(2.51, 2.5) && is_large(-2.51, 2.5));
        assert!(!is_large(1.99, 0.3) && is_large(2.01, 0.3) && is_large(-2.01, 0.3));
    }

    /// The figures of the issue: slope -10.2 % against a posterior of 2.5 %.
    #[test]
    fn a_large_error_is_named_and_qualifies_the_result() {
        let error =
            |percent, sd_percent| MeshError { quantity: "slope".into(), percent, sd_percent };
        let warnings = warned(&[error(-10.2, 2.5), error(0.4, 1.0)]);
        assert_eq!(warnings.len(), 1);
        assert_eq!(warnings[0].qualifier, Some(Qualifier::MeshError));
        let part = "change slope by -10.2 % (posterior sd 2.5 %) at the MAP";
        assert!(warnings[0].text.contains(part), "{warnings:?}");
        assert!(warned(&[error(-1.9, 0.5), error(2.4, 2.5)]).is_empty());
    }
}
