//! Rule: held-out specimens must not contradict their prediction.

use super::rule::{Rule, Warning};
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report::{Qualifier, ValidationVerdict, number};
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

/// Rule on the verdicts of the stage `validate`, which has compared probabilities with their bound.
pub(super) const RULE: Rule = Rule { reads: &["validate"], check };

/// Comparison of one quantity with held-out specimens.
struct Comparison {
    validation: String,
    quantity: String,
    /// Mean of the measurements and of the prediction.
    means: [f64; 2],
    /// Difference between the means, in standard deviations, as written in the file.
    deviation: String,
    /// Number of specimens, and the number inside the 50 % and the 90 % interval as written in the file.
    specimens: usize,
    inside: [String; 2],
    verdict: ValidationVerdict,
}

fn check(inputs: &Inputs<'_>) -> Result<Vec<Warning>, WorkflowError> {
    let name = "validation_summary.csv";
    if inputs.validation().is_empty() || inputs.file_if_there(name).is_none() {
        return Ok(Vec::new());
    }
    let path = inputs.file(name)?;
    let table = CsvTable::read(&path, &["validation", "qoi", "verdict"])?;
    let row = |row: TableRow<'_>| {
        let column = row.text("qoi");
        let quantity = Quantity::of_column(column);
        Ok(Comparison {
            validation: row.text("validation").to_owned(),
            quantity: quantity
                .map_or_else(|| column.to_owned(), |known_quantity| known_quantity.label()),
            means: [row.number("measured_mean")?, row.number("predicted_mean")?],
            deviation: row.text("deviation").to_owned(),
            specimens: row.number("specimens")? as usize,
            inside: ["inside50", "inside90"].map(|column| row.text(column).to_owned()),
            verdict: ValidationVerdict::named(row.text("verdict")).unwrap_or_default(),
        })
    };
    let all: Vec<Comparison> = table.rows().map(row).collect::<Result<_, InputError>>()?;
    Ok(all.iter().filter_map(warned).collect())
}

/// Returns the warning about a quantity, if there is one.
fn warned(comparison: &Comparison) -> Option<Warning> {
    let Comparison { validation, quantity, means: [measured, predicted], specimens, .. } =
        comparison;
    let [half, most] = &comparison.inside;
    match comparison.verdict {
        ValidationVerdict::Contradicted => {
            let deviation = match comparison.deviation.parse::<f64>() {
                Ok(deviation) => format!(", {deviation:+.1} standard deviations"),
                Err(_) => String::new(),
            };
            let inside = match most.is_empty() {
                true => String::new(),
                false => format!("; {most} of {specimens} are inside the 90 % interval"),
            };
            let text = format!(
                "The posterior does not predict the held-out specimens of the validation {validation}: {quantity} is {} \
                 on average, predicted {}{deviation}{inside}. Do not use the parameters for this test; compare its curves, \
                 size and rate with those of the calibration, and state an error of the model \
                 ([calibration.discrepancy]) or extend the model.",
                number(*measured),
                number(*predicted),
            );
            Some(Warning { text, qualifier: Some(Qualifier::NotValidated) })
        }
        ValidationVerdict::TooWide => {
            let text = format!(
                "The predicted intervals of {quantity} are wider than the scatter of the held-out specimens of the \
                 validation {validation}: {half} of {specimens} are inside the 50 % interval. The shared error or \
                 scatter_percent may be too large."
            );
            Some(Warning { text, qualifier: None })
        }
        ValidationVerdict::Consistent | ValidationVerdict::NotJudged => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contradiction_qualifies_and_wide_intervals_are_mentioned() {
        let comparison = |verdict, deviation: &str| Comparison {
            validation: "slow".to_owned(),
            quantity: "peak force (N)".to_owned(),
            means: [120.0, 150.0],
            deviation: deviation.to_owned(),
            specimens: 6,
            inside: ["0".to_owned(), "1".to_owned()],
            verdict,
        };
        let failed = warned(&comparison(ValidationVerdict::Contradicted, "-5.25")).unwrap();
        assert_eq!(failed.qualifier, Some(Qualifier::NotValidated));
        for part in ["slow", "peak force (N) is 120", "150", "-5.2 standard", "1 of 6 are inside"] {
            assert!(failed.text.contains(part), "{part}: {}", failed.text);
        }
        let unknown = warned(&comparison(ValidationVerdict::Contradicted, "")).unwrap();
        assert!(!unknown.text.contains("standard deviations"));
        let wide = warned(&comparison(ValidationVerdict::TooWide, "0")).unwrap();
        assert!(wide.qualifier.is_none() && wide.text.contains("0 of 6"), "{}", wide.text);
        for verdict in [ValidationVerdict::Consistent, ValidationVerdict::NotJudged] {
            assert!(warned(&comparison(verdict, "0")).is_none());
        }
    }
}
