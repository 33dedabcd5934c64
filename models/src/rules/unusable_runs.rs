//! Rule: the runs without quantities of interest must be few.

use surrogate::Dataset;

use super::rule::{Rule, Warning};
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::report::Qualifier;
use crate::results_folder::error::WorkflowError;
use crate::runs::unusable_runs::{RunOrigin, UnusableRuns};
use crate::table::{CsvTable, TableRow};

/// Rule on the runs of the ensemble that the surrogate lacks.
pub(super) const RULE: Rule = Rule { reads: &["ensemble"], check };

/// Start of the reason of a run that was repeated on a more accurate mesh.
const REPEATED: &str = "on level ";

fn check(inputs: &Inputs<'_>) -> Result<Vec<Warning>, WorkflowError> {
    let path = inputs.file("failed_runs.csv")?;
    let table = CsvTable::read(&path, &["run", "reason"])?;
    let failed =
        |row: TableRow<'_>| Ok((row.number("run")? as usize, row.text("reason").to_owned()));
    let failed: Vec<(usize, String)> =
        table.rows().map(failed).collect::<Result<_, InputError>>()?;
    if failed.is_empty() {
        return Ok(Vec::new());
    }
    let usable = Dataset::read_csv(inputs.file("runs.csv")?)?.len();
    Ok(warned(&failed, usable, RunOrigin::of(inputs)))
}

/// Returns the warnings about failed runs (number of the run, reason) beside `usable` runs.
fn warned(failed: &[(usize, String)], usable: usize, origin: RunOrigin) -> Vec<Warning> {
    let is_repeated = |reason: &str| reason.starts_with(REPEATED);
    let first = failed.iter().filter(|(_, reason)| !is_repeated(reason));
    let first = first.map(|(run, reason)| (*run, reason.as_str()));
    let mut warnings = Vec::new();
    if let Some(runs) = UnusableRuns::of(usable + first.clone().count(), first, origin) {
        let qualifier = runs.are_many().then_some(Qualifier::MissingRuns);
        warnings.push(Warning { text: runs.warning(), qualifier });
    }
    let repeated: Vec<_> = failed.iter().filter(|(_, reason)| is_repeated(reason)).collect();
    if let [(run, reason), ..] = &repeated[..] {
        let text = format!(
            "{} runs that [fidelity] repeats on a more accurate mesh have no quantities and are omitted from the correction of the \
             surrogate, which is less accurate near their parameters (failed_runs.csv). Run {run}: {}.",
            repeated.len(),
            reason.trim_end_matches('.')
        );
        warnings.push(Warning { text, qualifier: None });
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failed(count: usize, reason: &str) -> Vec<(usize, String)> {
        (1..=count).map(|run| (run, reason.to_owned())).collect()
    }

    /// The result has a qualifier if more than a tenth of the runs have no quantities.
    #[test]
    fn missing_runs_are_named_and_many_qualify_the_result() {
        let no_peak = "unusable: no peak";
        for (count, usable, qualifier) in
            [(1, 9, None), (2, 18, None), (13, 7, Some(Qualifier::MissingRuns))]
        {
            let warnings = warned(&failed(count, no_peak), usable, RunOrigin::BuiltIn);
            assert_eq!(warnings.len(), 1);
            assert_eq!(warnings[0].qualifier, qualifier);
            let part = format!("{count} of {} runs have no quantities", count + usable);
            assert!(warnings[0].text.contains(&part), "{warnings:?}");
        }
        let many = warned(&failed(3, no_peak), 20, RunOrigin::Simulator);
        assert_eq!(many[0].qualifier, Some(Qualifier::MissingRuns));
        assert!(warned(&[], 20, RunOrigin::BuiltIn).is_empty());
    }

    #[test]
    fn repeated_runs_are_counted_separately() {
        let warnings = warned(&failed(2, "on level 2: unusable: no peak"), 3, RunOrigin::BuiltIn);
        assert_eq!(warnings.len(), 1);
        assert_eq!(warnings[0].qualifier, None);
        assert!(warnings[0].text.contains("2 runs that [fidelity] repeats"), "{warnings:?}");
    }
}
