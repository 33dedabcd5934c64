//! Stage `verdict`: lists the identified parameters and all warnings.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use surrogate::Dataset;

use super::report::parameters;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::report::{CalibratedParameter, Qualifier};
use crate::results_folder::error::WorkflowError;
use crate::rules::rule::Warning;
use crate::rules::warnings::{of_rules, of_stages};

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let of_rules = of_rules(inputs, &|_| true)?;
    // the stages have already printed their warnings
    of_rules.iter().for_each(|warning| say("warning", &warning.text));
    let qualifiers: BTreeSet<Qualifier> = of_rules.iter().filter_map(|w| w.qualifier).collect();
    let mut warnings = of_rules;
    warnings.extend(of_stages(inputs, &|_| true)?);

    let data = Dataset::read_csv(inputs.file("runs.csv")?)?;
    let mut parameters = parameters(inputs, &data, &str::to_owned)?;
    parameters.iter_mut().for_each(|p| p.qualifiers.clone_from(&qualifiers));
    write_verdicts(task, &parameters, &warnings)
}

/// Writes the verdicts and the warnings. Returns the result of the stage in words.
pub(crate) fn write_verdicts(
    task: &Task<'_>,
    parameters: &[CalibratedParameter],
    warnings: &[Warning],
) -> Result<String, WorkflowError> {
    let rows = parameters
        .iter()
        .map(|p| [p.label.clone(), p.contraction.to_string(), p.verdict().to_string()]);
    task.write_csv("verdict.csv", ["parameter", "contraction", "verdict"], rows)?;
    let lines: String = warnings.iter().map(|warning| format!("{}\n", warning.text)).collect();
    task.write("warnings.txt", lines)?;
    let table = task.inputs.text("posterior.txt")?;
    task.write("summary.txt", summary(parameters, &table, warnings))?;
    let said: Vec<String> =
        parameters.iter().map(|p| format!("{} {}", p.label, p.verdict())).collect();
    let count = match warnings.len() {
        0 => "no warning".to_owned(),
        1 => "1 warning".to_owned(),
        n => format!("{n} warnings"),
    };
    Ok(format!("{}; {count}", said.join("; ")))
}

/// Text of the verdicts, the table of the posterior and the warnings.
fn summary(parameters: &[CalibratedParameter], table: &str, warnings: &[Warning]) -> String {
    let width = parameters.iter().map(|p| p.label.chars().count()).max().unwrap_or_default();
    let mut text = String::new();
    // writing to a String cannot fail
    for p in parameters {
        let _ = writeln!(text, "{:<width$}  {}", p.label, p.verdict());
    }
    let _ = write!(text, "\n{table}");
    for warning in warnings {
        let _ = writeln!(text, "! {}", warning.text);
    }
    if warnings.is_empty() {
        text.push_str("Nothing wrong was found.\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Prior;

    #[test]
    fn nothing_is_called_right_once_something_has_warned() {
        let draws = (0..100).map(|i| 40.0 + 0.2 * f64::from(i)).collect();
        let parameter = CalibratedParameter {
            label: "matrix.young_mpa".into(),
            prior: Prior::uniform(0.0, 100.0),
            map: 50.0,
            chains: vec![draws],
            contraction: 0.9,
            ..Default::default()
        };
        let quiet = summary(std::slice::from_ref(&parameter), "table\n", &[]);
        assert_eq!(quiet, "matrix.young_mpa  identified\n\ntable\nNothing wrong was found.\n");
        let warning =
            Warning { text: "The fit is poor.".into(), qualifier: Some(Qualifier::PoorFit) };
        let parameter =
            CalibratedParameter { qualifiers: [Qualifier::PoorFit].into(), ..parameter };
        let warned = summary(&[parameter], "table\n", &[warning]);
        assert_eq!(warned, "matrix.young_mpa  identified, fit poor\n\ntable\n! The fit is poor.\n");
    }
}
