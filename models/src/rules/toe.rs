//! Rule: displacements must not include a toe.

use super::rule::{Rule, Warning, qualified};
use crate::case::Toe;
use crate::experiments::experiment_inputs;
use crate::pipeline::inputs::Inputs;
use crate::report::Qualifier;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Length of a toe below which it is negligible, % of the displacement at peak.
const NEGLIGIBLE: f64 = 2.0;

/// Rule on the toes of the measured curves, unless `experiments.toe = "correct"` removes them. The rule applies
/// if the displacement at peak is a compared quantity. Otherwise only the stage `experiments` warns of the toe,
/// and the verdict is not qualified.
pub(super) const RULE: Rule = Rule { reads: &["experiments"], check };

fn check(inputs: &Inputs<'_>) -> Result<Vec<Warning>, WorkflowError> {
    if experiment_inputs::toe(inputs) == Toe::Correct {
        return Ok(Vec::new());
    }
    let Some(checks) = inputs.file_if_there("curve_checks.csv") else { return Ok(Vec::new()) };
    let checks = CsvTable::read(&checks, &["id", "finding", "value"])?;
    let peaks = inputs.file("experiments.csv")?;
    let peaks = CsvTable::read(&peaks, &["id"])?;
    // the table has this column only if the quantity is compared
    if !peaks.has_column("displacement_at_peak_mm") {
        return Ok(Vec::new());
    }
    let mut percents = Vec::new();
    for row in checks.rows().filter(|row| row.text("finding") == "toe") {
        let specimen = peaks.named("id", row.text("id"))?;
        if specimen.text("displacement_at_peak_mm").is_empty() {
            continue;
        }
        let peak_mm = specimen.number("displacement_at_peak_mm")?;
        percents.push(100.0 * row.number("value")? / peak_mm);
    }
    Ok(warned(&percents))
}

/// Returns the warning about toes. `percents` are the lengths of the toes of all specimens that have a
/// toe, in % of the displacement at peak.
fn warned(percents: &[f64]) -> Vec<Warning> {
    let large: Vec<f64> = percents.iter().map(|p| p.abs()).filter(|p| *p > NEGLIGIBLE).collect();
    if large.is_empty() {
        return Vec::new();
    }
    let (count, largest) = (large.len(), large.iter().fold(0.0, |a: f64, b| a.max(*b)));
    let text = format!(
        "The displacements of {count} specimens include a toe of up to {largest:.1} % of the displacement at peak, which \
         no simulation has: the parameters are biased by it. Write toe = \"correct\" under [experiments]."
    );
    qualified(Qualifier::Toe, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_toe_counts_above_two_percent() {
        assert!(warned(&[]).is_empty() && warned(&[1.99, -1.99]).is_empty());
        let [warning] = &warned(&[1.0, 2.01, 13.9])[..] else { panic!("one warning") };
        assert_eq!(warning.qualifier, Some(Qualifier::Toe));
        assert!(warning.text.contains("2 specimens") && warning.text.contains("13.9 %"));
    }
}
