//! Stage `report` of a case with several tests: one page for all tests.

use super::folders;
use super::parameters::Labels;
use super::verdict::parameters_and_warnings;
use crate::case::CaseFile;
use crate::case_inputs::CaseInputs;
use crate::error::InputError;
use crate::forward::shares_table::{SharesOfParameter, read_shares};
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
    let labels = Labels::read(inputs)?;
    let label = |name: &str| labels.of(name);
    let (parameters, warnings) = parameters_and_warnings(inputs, &label)?;
    let names: Vec<&str> = tests.iter().map(|(name, _)| name.as_str()).collect();
    let joint = Results {
        title: format!("Calibration to several tests: {}", names.join(", ")),
        parameters,
        warnings,
        budget: budget(inputs, &labels)?,
        sensitivities: sensitivities(inputs, &label)?,
        evidence: evidence(inputs)?,
        summary: summary(inputs)?,
        divergences: divergences(inputs)?,
        case_toml: case.to_toml(),
        ..Results::default()
    };
    let results = JointResults { joint, without: without(inputs, &labels)?, tests };
    task.write("report.html", joint_page(&results))?;
    Ok(task.path("report.html").display().to_string())
}

/// Contributions to the uncertainty of each parameter, with the labels of the parameters; empty if there is no table.
fn budget(inputs: &Inputs<'_>, labels: &Labels) -> Result<Vec<SharesOfParameter>, WorkflowError> {
    let parameters = read_shares(inputs)?.into_iter();
    Ok(parameters.map(|(name, shares)| (labels.of(&name), shares)).collect())
}

fn without(inputs: &Inputs<'_>, labels: &Labels) -> Result<Vec<WithoutTest>, WorkflowError> {
    let path = inputs.file("without_tests.csv")?;
    let table = CsvTable::read(&path, &["parameter", "without"])?;
    let row = |row: TableRow<'_>| {
        Ok(WithoutTest {
            parameter: labels.of(row.text("parameter")),
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
