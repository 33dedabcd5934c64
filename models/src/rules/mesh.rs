//! Rule: the intervals must include the error of the mesh.

use super::rule::{Rule, Warning, qualified};
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::Qualifier;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Smallest error of the mesh that is reported, %.
const NEGLIGIBLE: f64 = 2.0;

/// Rule on the error of each quantity at the posterior mode that was estimated with a second mesh.
pub(super) const RULE: Rule = Rule {
    reads: &["calibrate", "confirm"],
    check: |inputs| match inputs.is_built_in() {
        true => Ok(warned(&errors(inputs)?)),
        // Breccia does not know the mesh of another program
        false => Ok(Vec::new()),
    },
};

/// Estimated error of the mesh in one quantity, %, with the errors that the intervals include.
#[derive(Clone, Debug)]
struct MeshError {
    quantity: Quantity,
    percent: f64,
    /// Posterior standard deviation of the mean response.
    sd_percent: f64,
    /// Standard deviation that `[calibration.discrepancy]` specifies for the quantity; 0 if the table does not list the
    /// quantity.
    stated_percent: f64,
}

impl MeshError {
    /// Whether the error of the mesh is larger than the errors that the intervals include.
    fn is_large(&self) -> bool {
        let included = self.sd_percent.max(self.stated_percent);
        self.percent.abs() > NEGLIGIBLE.max(included)
    }
}

fn errors(inputs: &Inputs<'_>) -> Result<Vec<MeshError>, WorkflowError> {
    let [confirm, summary] = ["confirm.csv", "summary.csv"].map(|name| inputs.file(name));
    let (confirm, summary) = (confirm?, summary?);
    let confirm = CsvTable::read(&confirm, &["qoi", "mesh_error_percent"])?;
    let summary = CsvTable::read(&summary, &["parameter", "mean", "sd"])?;
    let stated = &inputs.calibration().discrepancy.percent;
    let mut errors = Vec::new();
    for row in confirm.rows() {
        // the error is not estimated for a mesh from a file
        let Ok(percent) = row.text("mesh_error_percent").parse::<f64>() else { continue };
        let Some(quantity) = Quantity::of_column(row.text("qoi")) else { continue };
        let mean = summary.named("parameter", &format!("mean[{}]", quantity.column()))?;
        let sd_percent = (100.0 * mean.number("sd")? / mean.number("mean")?).abs();
        let stated_percent = stated.get(&quantity).copied().unwrap_or(0.0);
        errors.push(MeshError { quantity, percent, sd_percent, stated_percent });
    }
    Ok(errors)
}

fn warned(errors: &[MeshError]) -> Vec<Warning> {
    let large: Vec<&MeshError> = errors.iter().filter(|error| error.is_large()).collect();
    if large.is_empty() {
        return Vec::new();
    }
    let words = |MeshError { quantity, percent, sd_percent, .. }: &&MeshError| {
        format!("{quantity} by {percent:+.1} % (posterior sd {sd_percent:.1} %)")
    };
    let entry = |error: &&MeshError| format!("{} = {:.1}", error.quantity, error.percent.abs());
    let words: Vec<String> = large.iter().map(words).collect();
    let entries: Vec<String> = large.iter().map(entry).collect();
    let text = format!(
        "The calibrated values are valid for this mesh only: the mesh is estimated to change {} at the MAP, and this \
         error is not included in the intervals. Use a smaller specimen.spacing_mm (with [fidelity] few runs need it) or \
         quadratic elements; or include the error in the intervals: calibration.discrepancy.percent = {{ {} }}.",
        words.join(", "),
        entries.join(", ")
    );
    qualified(Qualifier::MeshError, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qoi::Slope;

    fn error(percent: f64, sd_percent: f64, stated_percent: f64) -> MeshError {
        MeshError { quantity: Quantity::new(Slope), percent, sd_percent, stated_percent }
    }

    #[test]
    fn an_error_is_large_beyond_the_posterior_and_two_percent() {
        let is_large = |percent, sd_percent| error(percent, sd_percent, 0.0).is_large();
        assert!(!is_large(2.49, 2.5) && is_large(2.51, 2.5) && is_large(-2.51, 2.5));
        assert!(!is_large(1.99, 0.3) && is_large(2.01, 0.3) && is_large(-2.01, 0.3));
    }

    #[test]
    fn an_error_that_the_case_states_is_included() {
        assert!(!error(3.8, 1.4, 3.8).is_large() && error(3.9, 1.4, 3.8).is_large());
    }

    /// Values of a reported case: a slope error of −10.2 % with a posterior standard deviation of 2.5 %.
    #[test]
    fn a_large_error_is_named_with_what_mends_it_and_qualifies_the_result() {
        let warnings = warned(&[error(-10.2, 2.5, 0.0), error(0.4, 1.0, 0.0)]);
        assert_eq!(warnings.len(), 1);
        assert_eq!(warnings[0].qualifier, Some(Qualifier::MeshError));
        for part in ["change slope by -10.2 % (posterior sd 2.5 %) at the MAP", "{ slope = 10.2 }"]
        {
            assert!(warnings[0].text.contains(part), "{warnings:?}");
        }
        assert!(warned(&[error(-1.9, 0.5, 0.0), error(2.4, 2.5, 0.0)]).is_empty());
    }
}
