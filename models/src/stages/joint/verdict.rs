//! Stage `verdict` of a case with several tests: lists the parameters that all tests together identify, and all warnings.

use std::collections::BTreeSet;

use super::folders;
use super::parameters::{parameters, path_and_test};
use crate::case::CaseFile;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::report::{CalibratedParameter, Qualifier};
use crate::results_folder::error::WorkflowError;
use crate::rules::rule::Warning;
use crate::rules::warnings::{of_rules, of_stages};
use crate::stages::verdict::write_verdicts;
use crate::table::CsvTable;

/// Warnings of one test, and the restrictions of verdicts that follow from these warnings.
struct Judgement {
    test: String,
    qualifiers: BTreeSet<Qualifier>,
    is_out_of_range: bool,
    warnings: Vec<Warning>,
}

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let judgements = judgements(inputs)?;
    let parameters = judged(inputs, &str::to_owned, &judgements)?;
    write_verdicts(task, &parameters, &warnings_of(inputs, judgements)?)
}

/// Parameters of the joint posterior with the restrictions of their verdicts, and the texts of all warnings.
pub(super) fn parameters_and_warnings(
    inputs: &Inputs<'_>,
    label: &dyn Fn(&str) -> String,
) -> Result<(Vec<CalibratedParameter>, Vec<String>), WorkflowError> {
    let judgements = judgements(inputs)?;
    let parameters = judged(inputs, label, &judgements)?;
    let warnings = warnings_of(inputs, judgements)?;
    Ok((parameters, warnings.into_iter().map(|warning| warning.text).collect()))
}

fn judgements(inputs: &Inputs<'_>) -> Result<Vec<Judgement>, WorkflowError> {
    let mut judgements = Vec::new();
    for test in inputs.tests()? {
        let folder = folders::of_test(&test.name);
        let dir = inputs.folder().join(&folder);
        let file = CaseFile { path: dir.join("case.toml"), ..test.file };
        let of_test = inputs.of_folder(&file, &dir);
        let mut warnings = of_rules(&of_test, &|_| true)?;
        let qualifiers = warnings.iter().filter_map(|warning| warning.qualifier).collect();
        warnings.extend(of_stages(&of_test, &|_| true)?);
        let path = of_test.file("range.csv")?;
        let table = CsvTable::read(&path, &["inside"])?;
        let is_out_of_range = table.rows().any(|row| row.text("inside") != "true");
        inputs.reads_in_folder(&of_test, &folder);
        judgements.push(Judgement { test: test.name, qualifiers, is_out_of_range, warnings });
    }
    Ok(judgements)
}

/// Parameters of the joint posterior. A restriction of a test applies to the parameters of this test and to all shared
/// parameters.
fn judged(
    inputs: &Inputs<'_>,
    label: &dyn Fn(&str) -> String,
    judgements: &[Judgement],
) -> Result<Vec<CalibratedParameter>, WorkflowError> {
    let mut all = parameters(inputs)?;
    for parameter in &mut all {
        let (_, only) = path_and_test(&parameter.label);
        // the end of a trend, such as `at 20 °C`, is a parameter of all tests
        let only = only.filter(|only| judgements.iter().any(|warned| warned.test == *only));
        let selected =
            judgements.iter().filter(|warned| only.is_none_or(|only| only == warned.test));
        for judgement in selected.collect::<Vec<_>>() {
            parameter.qualifiers.extend(&judgement.qualifiers);
            parameter.out_of_range |= judgement.is_out_of_range;
        }
        parameter.label = label(&parameter.label);
    }
    Ok(all)
}

/// Returns the warnings of the joint calibration, and the warnings of the tests with the names of the tests.
fn warnings_of(
    inputs: &Inputs<'_>,
    judgements: Vec<Judgement>,
) -> Result<Vec<Warning>, WorkflowError> {
    let mut all = of_stages(inputs, &|stage| stage == "calibrate")?;
    let mut of_tests: Vec<(Warning, Vec<String>)> = Vec::new();
    for Judgement { test, warnings, .. } in judgements {
        for warning in warnings {
            match of_tests.iter_mut().find(|(other, _)| *other == warning) {
                Some((_, tests)) => tests.push(test.clone()),
                None => of_tests.push((warning, vec![test.clone()])),
            }
        }
    }
    all.extend(of_tests.into_iter().map(|(warning, tests)| Warning {
        text: format!("{}: {}", tests.join(", "), warning.text),
        ..warning
    }));
    Ok(all)
}
