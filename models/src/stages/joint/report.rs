//! Stage `report` of a case with several tests: one page for all tests.

use super::folders;
use super::parameters::label;
use super::verdict::parameters_and_warnings;
use crate::case::CaseFile;
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::report::{JointResults, Results, WithoutTest, joint_page};
use crate::results_folder::error::WorkflowError;
use crate::stages::report::{divergences, evidence, load, sensitivities, summary};
use crate::table::{CsvTable, TableRow};

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let mut tests = Vec::new();
    for test in inputs.tests()? {
        let folder = folders::of_test(&test.name);
        let dir = inputs.folder().join(&folder);
        let file = CaseFile::read(&dir.join("case.toml"))?;
        let of_test = inputs.of_folder(&file, &dir);
        tests.push((test.name, load(&of_test)?));
        inputs.reads_in_folder(&of_test, &folder);
    }
    let case = inputs.case();
    let (parameters, warnings) = parameters_and_warnings(inputs, &label)?;
    let names: Vec<&str> = tests.iter().map(|(name, _)| name.as_str()).collect();
    let joint = Results {
        title: format!("Calibration to several tests: {}", names.join(", ")),
        parameters,
        warnings,
        budget: budget(inputs)?,
        sensitivities: sensitivities(inputs, &label)?,
        evidence: evidence(inputs)?,
        summary: summary(inputs)?,
        divergences: divergences(inputs)?,
        case_toml: case.to_toml(),
        ..Results::default()
    };
    let results = JointResults { joint, without: without(inputs)?, tests };
    task.write("report.html", joint_page(&results))?;
    Ok(task.path("report.html").display().to_string())
}

/// Label of a parameter, with the share of each source in its variance.
type Shares = (String, Vec<(String, f64)>);

/// Contributions to the uncertainty of each parameter, in the order of the file; empty if there is no file.
fn budget(inputs: &Inputs<'_>) -> Result<Vec<Shares>, WorkflowError> {
    let Some(path) = inputs.file_if_there("uncertainty.csv") else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &["parameter", "source", "share"])?;
    let mut budget: Vec<Shares> = Vec::new();
    for row in table.rows() {
        let label = label(row.text("parameter"));
        let part = (row.text("source").to_owned(), row.number("share")?);
        match budget.last_mut() {
            Some((parameter, sources)) if *parameter == label => sources.push(part),
            _ => budget.push((label, vec![part])),
        }
    }
    Ok(budget)
}

fn without(inputs: &Inputs<'_>) -> Result<Vec<WithoutTest>, WorkflowError> {
    let path = inputs.file("without_tests.csv")?;
    let table = CsvTable::read(&path, &["parameter", "without"])?;
    let row = |row: TableRow<'_>| {
        Ok(WithoutTest {
            parameter: label(row.text("parameter")),
            test: row.text("without").to_owned(),
            mean: row.number("mean")?,
            sd: row.number("sd")?,
            interval: [row.number("q05")?, row.number("q95")?],
            contraction: row.number("contraction")?,
            shift_sd: row.number("shift_sd")?,
            sd_ratio: row.number("sd_ratio")?,
        })
    };
    Ok(table.rows().map(row).collect::<Result<_, InputError>>()?)
}
