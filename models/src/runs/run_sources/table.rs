//! The source `design.import`: a table of finished runs with their parameters and quantities.

use std::path::Path;

use fem::{RunEnd, RunRecord, RunStatus, Sensitivities};

use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::runs::run_source::{RequestedRuns, RunSource};
use crate::table::{CsvTable, TableRow};

/// Runs of an imported table.
pub(crate) struct ImportedRuns {
    /// The runs whose parameters are in the ranges of the priors.
    pub(crate) records: Vec<RunRecord>,
    /// Number of runs outside the ranges.
    pub(crate) outside: usize,
}

/// Opens the source, if the case has `design.import`.
///
/// # Errors
/// Fails if the table cannot be read, or if it lacks a parameter or a quantity.
pub(super) fn open(inputs: &Inputs<'_>) -> Result<Option<Box<dyn RunSource>>, WorkflowError> {
    let Some(path) = &inputs.design().import else { return Ok(None) };
    let file = inputs.named_file(path);
    let ranges: Vec<(String, [f64; 2])> = inputs
        .first_prior()?
        .iter()
        .map(|(parameter, prior)| (parameter.to_string(), prior.range()))
        .collect();
    let runs = ImportedRuns::read(&file, &ranges, &inputs.qoi().quantities)?;
    Ok(Some(Box::new(runs)))
}

impl ImportedRuns {
    /// Reads a table with one line per run. `ranges` are the names of the parameters with the ranges of their priors. A run
    /// that lacks a quantity counts as failed.
    ///
    /// # Errors
    /// Fails if a column is missing, an entry is not a number, no run is in the ranges, or a parameter is the same in all
    /// runs.
    pub(crate) fn read(
        file: &Path,
        ranges: &[(String, [f64; 2])],
        quantities: &[Quantity],
    ) -> Result<Self, InputError> {
        let columns: Vec<String> = quantities.iter().map(|q| q.column().into_owned()).collect();
        let names = || ranges.iter().map(|(name, _)| name.as_str());
        let required: Vec<&str> = names().chain(columns.iter().map(String::as_str)).collect();
        let table = CsvTable::read(file, &required)?;
        let names: Vec<String> = names().map(str::to_owned).collect();
        let (mut records, mut outside) = (Vec::new(), 0);
        for (row, id) in table.rows().zip(1..) {
            let inputs: Vec<f64> =
                names.iter().map(|name| row.number(name)).collect::<Result<_, _>>()?;
            let is_inside =
                |(x, (_, [low, high])): (&f64, &(String, [f64; 2]))| low <= x && x <= high;
            if !inputs.iter().zip(ranges).all(is_inside) {
                outside += 1;
                continue;
            }
            records.push(record(id, &names, inputs, row, &columns)?);
        }
        if records.is_empty() {
            let problem = format!("has no run in the ranges of the priors, of {outside} runs");
            let help = "Widen the priors, or import runs of these ranges.";
            return Err(InputError::new(file, "", "", problem, help));
        }
        check_variation(file, &names, &records)?;
        Ok(Self { records, outside })
    }
}

/// Refuses parameters that are the same in all runs: the runs do not show the dependence on such a parameter, and its
/// posterior would be its prior.
fn check_variation(file: &Path, names: &[String], records: &[RunRecord]) -> Result<(), InputError> {
    let [first, others @ ..] = records else { return Ok(()) };
    if others.is_empty() {
        return Ok(());
    }
    for (k, name) in names.iter().enumerate() {
        let value = first.inputs[k];
        if others.iter().all(|record| record.inputs[k] == value) {
            let problem = format!("is the same in all {} runs in the ranges", records.len());
            let help = "Import runs with different values of this parameter, or remove it from [parameters] or [prior].";
            let column = format!("column {name}");
            return Err(InputError::new(file, column, value.to_string(), problem, help));
        }
    }
    Ok(())
}

fn record(
    id: usize,
    names: &[String],
    inputs: Vec<f64>,
    row: TableRow<'_>,
    columns: &[String],
) -> Result<RunRecord, InputError> {
    let missing = columns.iter().find(|column| row.text(column).is_empty());
    let (status, end) = match missing {
        Some(column) => {
            (RunStatus::Failed(format!("the imported table has no {column}")), RunEnd::Failed)
        }
        None => (RunStatus::Finished, RunEnd::Displacement),
    };
    let present = columns.iter().filter(|column| !row.text(column).is_empty());
    let values = present.map(|column| Ok((column.clone(), row.number(column)?)));
    Ok(RunRecord {
        id,
        names: names.to_vec(),
        inputs,
        status,
        end,
        seconds: 0.0,
        curve: Vec::new(),
        sensitivities: Sensitivities::default(),
        values: values.collect::<Result<_, InputError>>()?,
    })
}

impl RunSource for ImportedRuns {
    fn parameter_points(&self) -> Option<Vec<Vec<f64>>> {
        Some(self.records.iter().map(|record| record.inputs.clone()).collect())
    }

    fn notes(&self) -> Vec<String> {
        let text = format!(
            "{} imported runs are outside the ranges of the priors and are not used",
            self.outside
        );
        (self.outside > 0).then_some(text).into_iter().collect()
    }

    fn records(&self, requested: &RequestedRuns<'_>) -> Result<Vec<RunRecord>, WorkflowError> {
        let records = requested.named.runs.iter().map(|run| {
            let record_of_run =
                self.records.get(run.id - 1).filter(|record| record.inputs == run.inputs);
            record_of_run.map(|record| RunRecord { id: run.id, ..record.clone() }).ok_or_else(
                || {
                    let message =
                        "design.import has finished runs only, at other points of the parameters";
                    WorkflowError::Unusable(message.to_owned())
                },
            )
        });
        records.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ImportedRuns, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("runs.csv");
        std::fs::write(&path, text).unwrap();
        let ranges = [("k1".to_owned(), [0.0, 1.0]), ("k2".to_owned(), [-1.0, 1.0])];
        let quantity: Quantity = toml::Value::from("column:u_mm").try_into().unwrap();
        ImportedRuns::read(&path, &ranges, &[quantity]).map_err(|error| error.to_string())
    }

    #[test]
    fn runs_in_the_ranges_are_read_and_others_are_counted() {
        let text = "note,k2,k1,u_mm\na,0.5,0.25,-3\nb,0.5,1.25,7\nc,-1,1,\n";
        let runs = read(text).unwrap();
        assert_eq!((runs.records.len(), runs.outside), (2, 1));
        let [first, second] = &runs.records[..] else { panic!("two runs") };
        assert_eq!(
            (first.id, &first.inputs[..], first.values["u_mm"]),
            (1, &[0.25, 0.5][..], -3.0)
        );
        assert_eq!(first.status, RunStatus::Finished);
        assert_eq!((second.id, &second.inputs[..]), (3, &[1.0, -1.0][..]));
        assert!(matches!(&second.status, RunStatus::Failed(reason) if reason.contains("u_mm")));
    }

    #[test]
    fn tables_that_cannot_be_used_are_refused() {
        for (text, problem) in [
            ("k1,u_mm\n0.5,1\n", "column k2 is missing"),
            ("k1,k2\n0.5,1\n", "column u_mm is missing"),
            ("k1,k2,u_mm\n0.5,x,1\n", "line 2, column k2 = x"),
            ("k1,k2,u_mm\n5,0,1\n", "no run in the ranges"),
            ("k1,k2,u_mm\n0.1,0.5,1\n0.2,0.5,2\n", "column k2 = 0.5: is the same in all 2 runs"),
        ] {
            let error = read(text).err().unwrap();
            assert!(error.contains(problem), "{error}");
        }
    }
}
