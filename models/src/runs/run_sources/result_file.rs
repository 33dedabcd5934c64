//! The file that a program of the user writes: a curve, or a table of quantities.

use std::collections::BTreeMap;
use std::path::Path;

use fem::CurvePoint;

use crate::error::InputError;
use crate::table::{CsvTable, TableRow};

/// Columns of a curve; the force may also be `force_N`.
const DISPLACEMENT: &str = "displacement_mm";
const FORCE: [&str; 2] = ["force_n", "force_N"];
const TIME: &str = "time_s";

/// Columns of a table with one line per quantity.
const LONG: [&str; 2] = ["quantity", "value"];

/// Content of a result file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ProgramResult {
    /// Points of the curve, without the unloaded start; empty for a table of quantities.
    pub(super) curve: Vec<CurvePoint>,
    /// Quantities by the names of their columns.
    pub(super) values: BTreeMap<String, f64>,
}

/// Reads a result file. A table with a column `displacement_mm` is a curve. A table with the columns `quantity,value` has
/// one line per quantity. Any other table has one column per quantity and one line.
///
/// # Errors
/// Fails if the file does not have one of these three forms, or if an entry is not a finite number.
pub(super) fn read_result(path: &Path) -> Result<ProgramResult, InputError> {
    let table = CsvTable::read(path, &[])?;
    if table.has_column(DISPLACEMENT) {
        return Ok(ProgramResult { curve: curve(&table, path)?, ..ProgramResult::default() });
    }
    let values = match LONG.iter().all(|column| table.has_column(column)) {
        true => {
            let value =
                |row: TableRow<'_>| Ok((row.text(LONG[0]).to_owned(), row.number(LONG[1])?));
            table.rows().map(value).collect::<Result<_, InputError>>()?
        }
        false => only_row(&table, path)?,
    };
    Ok(ProgramResult { values, ..ProgramResult::default() })
}

fn curve(table: &CsvTable<'_>, path: &Path) -> Result<Vec<CurvePoint>, InputError> {
    let Some(force) = FORCE.into_iter().find(|column| table.has_column(column)) else {
        let help = "A curve has the columns displacement_mm and force_n; time_s is optional.";
        return Err(InputError::new(path, "line 1", "", "the column force_n is missing", help));
    };
    let has_time = table.has_column(TIME);
    let point = |row: TableRow<'_>| {
        Ok(CurvePoint {
            time_s: if has_time { row.number(TIME)? } else { 0.0 },
            displacement_mm: row.number(DISPLACEMENT)?,
            force_n: row.number(force)?,
            ..CurvePoint::default()
        })
    };
    let mut curve = table.rows().map(point).collect::<Result<Vec<_>, InputError>>()?;
    // curves of runs begin with the first load step
    if curve.first().is_some_and(|first| first.displacement_mm == 0.0 && first.force_n == 0.0) {
        curve.remove(0);
    }
    match curve.is_empty() {
        true => Err(InputError::new(path, "", "", "has no points", "Write the curve there.")),
        false => Ok(curve),
    }
}

fn only_row(table: &CsvTable<'_>, path: &Path) -> Result<BTreeMap<String, f64>, InputError> {
    let mut rows = table.rows();
    let (Some(row), None) = (rows.next(), rows.next()) else {
        let count = table.rows().count();
        let problem = format!("has {count} lines of values");
        let help = "Write the names of the quantities in the first line and their values in the second, or the columns \
                    quantity,value, or a curve with displacement_mm,force_n.";
        return Err(InputError::new(path, "", "", problem, help));
    };
    table.columns().map(|column| Ok((column.to_owned(), row.number(column)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ProgramResult, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("result.csv");
        std::fs::write(&path, text).unwrap();
        read_result(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn curves_are_read_with_and_without_time() {
        for (text, time_s) in [
            ("displacement_mm,force_n\n0,0\n0.1,5\n0.2,8\n", [0.0, 0.0]),
            ("time_s,displacement_mm,force_N\n1,0.1,5\n2.5,0.2,8\n", [1.0, 2.5]),
        ] {
            let outcome = read(text).unwrap();
            let curve: Vec<[f64; 3]> =
                outcome.curve.iter().map(|p| [p.time_s, p.displacement_mm, p.force_n]).collect();
            assert_eq!(curve, [[time_s[0], 0.1, 5.0], [time_s[1], 0.2, 8.0]]);
            assert!(outcome.values.is_empty());
        }
        let error = read("displacement_mm,load\n0.1,5\n").unwrap_err();
        assert!(error.contains("force_n is missing"), "{error}");
        let error = read("displacement_mm,force_n\n0,0\n").unwrap_err();
        assert!(error.contains("no points"), "{error}");
    }

    #[test]
    fn quantities_stand_in_columns_or_in_lines() {
        let expected: BTreeMap<String, f64> =
            [("deflection_mm".to_owned(), 1.5), ("f1_Hz".to_owned(), -3e2)].into();
        for text in [
            "deflection_mm,f1_Hz\n1.5,-3e2\n",
            "# of solver 7\nquantity,value\ndeflection_mm,1.5\nf1_Hz,-3e2\n",
        ] {
            assert_eq!(read(text).unwrap().values, expected);
        }
        for (text, problem) in [
            ("a,b\n", "0 lines"),
            ("a,b\n1,2\n3,4\n", "2 lines"),
            ("a,b\n1,nan\n", "line 2, column b = nan: is not a finite number"),
            ("quantity,value\na,x\n", "is not a finite number"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(problem), "{error}");
        }
    }
}
