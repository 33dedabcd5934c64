//! Table `uncertainty.csv`: the share of each source in the posterior variance of each parameter.

use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

const FILE: &str = "uncertainty.csv";
const COLUMNS: [&str; 3] = ["parameter", "source", "share"];

/// Name of a parameter, with the share of each source in its variance.
pub(crate) type SharesOfParameter = (String, Vec<(String, f64)>);

/// Writes the table.
///
/// # Errors
/// The errors of [`Task::write_csv`].
pub(crate) fn write_shares(
    task: &Task<'_>,
    parameters: &[SharesOfParameter],
) -> Result<(), WorkflowError> {
    let rows = parameters.iter().flat_map(|(parameter, shares)| {
        let row = move |(source, share): &(String, f64)| {
            [parameter.clone(), source.clone(), share.to_string()]
        };
        shares.iter().map(row)
    });
    task.write_csv(FILE, COLUMNS, rows)
}

/// Reads the table, in its order; empty if there is no table.
///
/// # Errors
/// Fails if an entry is not a number.
pub(crate) fn read_shares(inputs: &Inputs<'_>) -> Result<Vec<SharesOfParameter>, WorkflowError> {
    let Some(path) = inputs.file_if_there(FILE) else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &COLUMNS)?;
    let mut parameters: Vec<SharesOfParameter> = Vec::new();
    for row in table.rows() {
        let [parameter, source, share] = COLUMNS;
        let (parameter, source) = (row.text(parameter).to_owned(), row.text(source).to_owned());
        let part = (source, row.number(share)?);
        match parameters.last_mut() {
            Some((last, shares)) if *last == parameter => shares.push(part),
            _ => parameters.push((parameter, vec![part])),
        }
    }
    Ok(parameters)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::case::CaseFile;

    #[test]
    fn the_table_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let (file, interrupt) = (CaseFile::default_case(), AtomicBool::new(false));
        let inputs = || Inputs::new(&file, dir.path(), |_| Some("calibrate"));
        assert!(read_shares(&inputs()).unwrap().is_empty());
        let task = Task::new("calibrate", inputs(), dir.path(), 1, &interrupt);
        let shares = |a, b| vec![("specimens".to_owned(), a), ("mesh".to_owned(), b)];
        let parameters =
            [("E".to_owned(), shares(0.75, 0.25)), ("ξ (slow)".to_owned(), shares(1.0, 1.0 / 3.0))];
        write_shares(&task, &parameters).unwrap();
        assert_eq!(read_shares(&inputs()).unwrap(), parameters);
    }
}
