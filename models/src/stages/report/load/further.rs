//! Loads the expected results of further tests, from the files of the stage `next-test`.

use super::posterior::label_of;
use crate::case::Case;
use crate::pipeline::inputs::Inputs;
use crate::report::{FurtherExpected, FurtherNeeded, FurtherParameter, FurtherTestResult};
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

/// Loads one entry per parameter, in the order of the file; empty if the stage was not run.
pub(super) fn further(
    inputs: &Inputs<'_>,
    case: &Case,
) -> Result<Vec<FurtherParameter>, WorkflowError> {
    let files = ["next-test.csv", "next-test-specimens.csv"].map(|name| inputs.file_if_there(name));
    let [Some(expected), Some(needed)] = files else { return Ok(Vec::new()) };
    let mut parameters: Vec<(String, FurtherParameter)> = Vec::new();
    let expected =
        CsvTable::read(&expected, &["candidate", "parameter", "specimens", "contraction"])?;
    for row in expected.rows() {
        let (specimens, contraction) =
            (row.number("specimens")? as usize, row.number("contraction")?);
        let test = test_of(&mut parameters, case, row);
        test.expected.push(FurtherExpected { specimens, contraction });
    }
    let needed =
        CsvTable::read(&needed, &["candidate", "parameter", "goal", "value", "specimens"])?;
    for row in needed.rows() {
        let one = FurtherNeeded {
            is_width: row.text("goal") == "width90",
            value: row.number("value")?,
            specimens: row.text("specimens").parse().ok(),
            limit: row.number("limit")?,
        };
        test_of(&mut parameters, case, row).needed.push(one);
    }
    for (_, parameter) in &mut parameters {
        let first = parameter.tests.first().and_then(|test| test.expected.first());
        parameter.now = first.map_or(0.0, |expected| expected.contraction);
    }
    Ok(parameters.into_iter().map(|(_, parameter)| parameter).collect())
}

/// Loads the candidates that the stage omitted: name and reason.
pub(super) fn failed(inputs: &Inputs<'_>) -> Result<Vec<(String, String)>, WorkflowError> {
    let Some(path) = inputs.file_if_there("next-test-failed.csv") else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &["candidate", "reason"])?;
    let cells =
        |row: TableRow<'_>| (row.text("candidate").to_owned(), row.text("reason").to_owned());
    Ok(table.rows().map(cells).collect())
}

/// Returns the entry of a row's parameter and test, and creates it if it is missing.
fn test_of<'a>(
    parameters: &'a mut Vec<(String, FurtherParameter)>,
    case: &Case,
    row: TableRow<'_>,
) -> &'a mut FurtherTestResult {
    let (path, name) = (row.text("parameter"), row.text("candidate"));
    let at =
        parameters.iter().position(|(known_path, _)| known_path == path).unwrap_or_else(|| {
            let label = label_of(case, path);
            parameters
                .push((path.to_owned(), FurtherParameter { label, ..FurtherParameter::default() }));
            parameters.len() - 1
        });
    let tests = &mut parameters[at].1.tests;
    let at = tests.iter().position(|test| test.name == name).unwrap_or_else(|| {
        tests.push(FurtherTestResult { name: name.to_owned(), ..FurtherTestResult::default() });
        tests.len() - 1
    });
    &mut tests[at]
}
