//! Layout of a record: where its names, units and readings are.

use std::path::Path;

use super::number::clock_seconds;
use super::options::ReadOptions;
use super::text::{Row, Sheet};
use super::unit::Unit;
use crate::error::InputError;

/// Number of rows after the first row with readings that must contain readings, too.
const FOLLOWING: usize = 2;

/// Name and unit of a column.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Name {
    /// Name as written in the file.
    pub(super) written: String,
    /// Name without the unit.
    pub(super) name: String,
    /// Unit from the row of units, or else from the name.
    pub(super) unit: Option<String>,
}

/// Positions of names, units and readings in a sheet.
pub(super) struct Layout {
    pub(super) names: Vec<Name>,
    /// Line number of the names.
    pub(super) names_line: usize,
    /// Number of lines before the first reading.
    pub(super) header_lines: usize,
    /// Index of the first row with readings.
    first: usize,
    /// Index after the last row with readings.
    end: usize,
    /// For each column, whether the first row with readings has a clock time.
    is_clock: Vec<bool>,
    /// Description of the lines after the readings; `None` if there are none.
    pub(super) after_readings: Option<String>,
}

impl Layout {
    /// Finds the layout of a sheet.
    ///
    /// # Errors
    /// If there are no readings, no names above the readings, or fewer names than columns with readings.
    pub(super) fn of(
        file: &Path,
        sheet: &Sheet,
        options: &ReadOptions,
    ) -> Result<Self, InputError> {
        let (rows, stopped) = match stop(&sheet.rows, options) {
            Some(index) => (&sheet.rows[..index], sheet.rows.get(index)),
            None => (&sheet.rows[..], None),
        };
        let is_reading = |row: &Row| sheet.has_readings(row);
        let is_start = |i: usize| {
            let following = &rows[i..(i + 1 + FOLLOWING).min(rows.len())];
            following.iter().all(|row| is_reading(row) && row.cells.len() == rows[i].cells.len())
        };
        let after_skip = |row: &Row| row.line > options.skip.unwrap_or(0);
        let start = rows.iter().position(after_skip).unwrap_or(rows.len());
        let Some(first) = (start..rows.len()).find(|&i| is_start(i)) else {
            let problem = "has no consecutive rows of numbers";
            let help = "Check separator, decimal and skip under [experiments.read].";
            return Err(InputError::new(file, "", "", problem, help));
        };
        let above = &rows[start..first];
        let (units, names) = match above {
            [.., names, units] if is_of_units(units) => (Some(units), Some(names)),
            [.., names] => (None, Some(names)),
            [] => (None, None),
        };
        // if the option `skip` is set, the names are on the first line after the skipped lines
        let names = if options.skip.is_some() { above.first().or(names) } else { names };
        let Some(header) = names.filter(|names| names.cells.iter().any(|cell| !cell.is_empty()))
        else {
            let location = format!("line {}", rows[first].line);
            let help = "Write a line with the names of the columns above the readings, as displacement_mm,force_N.";
            return Err(InputError::new(
                file,
                location,
                "",
                "has no names of columns above it",
                help,
            ));
        };
        let width =
            rows[first].cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |i| i + 1);
        let named = header.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |i| i + 1);
        if named < width {
            let location = format!("line {}", rows[first].line);
            let problem = format!("has {width} fields, line {} has {named} names", header.line);
            let help = "If commas are both decimal signs and separators, export with another separator; otherwise state \
                        separator, decimal and skip under [experiments.read].";
            return Err(InputError::new(file, location, "", problem, help));
        }
        let names = header.cells.iter().enumerate().map(|(i, written)| {
            let (name, own_unit) = name_and_unit(written);
            let unit = units.and_then(|units| units.cells.get(i)).filter(|unit| !unit.is_empty());
            Name { written: written.clone(), name, unit: unit.cloned().or(own_unit) }
        });
        let end = end_of_readings(sheet, &rows[first..]).map_or(rows.len(), |count| first + count);
        let is_clock = rows[first].cells.iter().map(|cell| clock_seconds(cell, false).is_some());
        let following = rows.get(end).or(stopped);
        let after_readings = following.map(|row| {
            let lines = sheet.rows.len() - end;
            let text = row.cells.iter().find(|cell| !cell.is_empty()).map_or("", String::as_str);
            let lines = if lines == 1 { "1 line".to_owned() } else { format!("{lines} lines") };
            format!("{lines} after the readings omitted, from line {} ({text:?})", row.line)
        });
        Ok(Self {
            names: names.collect(),
            names_line: header.line,
            header_lines: rows[first].line - 1,
            first,
            end,
            is_clock: is_clock.collect(),
            after_readings,
        })
    }

    /// Whether the first reading of a column is a clock time.
    pub(super) fn is_clock(&self, index: usize) -> bool {
        self.is_clock.get(index).copied().unwrap_or(false)
    }

    /// Reads a column of clock times in s. `are_hours`: whether two parts are hours and minutes.
    ///
    /// # Errors
    /// If a cell is not a clock time.
    pub(super) fn clock_times(
        &self,
        file: &Path,
        sheet: &Sheet,
        index: usize,
        are_hours: bool,
    ) -> Result<Vec<f64>, InputError> {
        let time = |row: &Row| {
            let cell = row.cells.get(index).map_or("", String::as_str);
            clock_seconds(cell, are_hours).ok_or_else(|| {
                let help = "Clock times are mm:ss or hh:mm:ss. Name another column with time = \"…\", or write \
                            time = \"\" to read no time, under [experiments.read].";
                self.cell_error(file, row, index, "is not a clock time", help)
            })
        };
        sheet.rows[self.first..self.end].iter().map(time).collect()
    }

    /// Reads the numbers of a column without conversion of units.
    ///
    /// # Errors
    /// If a cell is not a number.
    pub(super) fn column_values(
        &self,
        file: &Path,
        sheet: &Sheet,
        index: usize,
    ) -> Result<Vec<f64>, InputError> {
        let number = |row: &Row| {
            let cell = row.cells.get(index).map_or("", String::as_str);
            sheet.number(cell).ok_or_else(|| {
                let help = "State separator and decimal under [experiments.read]. If the readings end above this line, \
                            write stop_at = \"…\" with the text at the start of the first line after them.";
                self.cell_error(file, row, index, "is not a finite number", help)
            })
        };
        sheet.rows[self.first..self.end].iter().map(number).collect()
    }

    fn cell_error(
        &self,
        file: &Path,
        row: &Row,
        index: usize,
        problem: &str,
        help: &str,
    ) -> InputError {
        let location = format!("line {}, column {}", row.line, self.names[index].written);
        let cell = row.cells.get(index).map_or("", String::as_str);
        InputError::new(file, location, cell, problem, help)
    }

    /// Lists the names of the columns as written in the file.
    pub(super) fn listed(&self) -> String {
        let names = self.names.iter().filter(|name| !name.written.is_empty());
        names.map(|name| format!("{:?}", name.written)).collect::<Vec<_>>().join(", ")
    }

    /// Creates an error at the name of a column.
    pub(super) fn error(
        &self,
        file: &Path,
        name: &str,
        value: &str,
        problem: impl Into<String>,
        help: impl Into<String>,
    ) -> InputError {
        let location = format!("line {}, column {name}", self.names_line);
        InputError::new(file, location, value, problem, help)
    }
}

/// Index of the row at which the readings end by the option `stop_at`.
fn stop(rows: &[Row], options: &ReadOptions) -> Option<usize> {
    let text = options.stop_at.as_ref().map(|text| text.trim().to_lowercase())?;
    let after_skip = |row: &Row| row.line > options.skip.unwrap_or(0) + 1;
    let is_stop = |row: &Row| {
        let mut filled = row.cells.iter().filter(|cell| !cell.is_empty());
        filled.next().is_some_and(|cell| cell.to_lowercase().starts_with(&text))
    };
    rows.iter().position(|row| after_skip(row) && is_stop(row))
}

/// Number of rows with readings, if all rows after them start with a word in a column of numbers, such as a row
/// `Maximum;0,15;147`. `None` if the readings extend to the last row, or if the rows after the readings may be readings
/// with mistakes.
fn end_of_readings(sheet: &Sheet, rows: &[Row]) -> Option<usize> {
    let is_value =
        |cell: &str| sheet.number(cell).is_some() || clock_seconds(cell, false).is_some();
    let columns: Vec<usize> =
        (0..rows[0].cells.len()).filter(|&i| is_value(&rows[0].cells[i])).collect();
    let is_reading =
        |row: &Row| columns.iter().all(|&i| row.cells.get(i).is_some_and(|cell| is_value(cell)));
    let count = rows.iter().rposition(is_reading)? + 1;
    let is_word =
        |cell: &str| cell.chars().filter(|c| c.is_alphabetic()).count() >= 2 && !is_missing(cell);
    let starts_with_word = |row: &Row| {
        let filled = row.cells.iter().position(|cell| !cell.is_empty());
        filled.is_some_and(|i| columns.contains(&i) && is_word(&row.cells[i]))
    };
    (count < rows.len() && rows[count..].iter().all(starts_with_word)).then_some(count)
}

/// Whether a cell is a placeholder for a missing number.
fn is_missing(cell: &str) -> bool {
    let names = ["n/a", "na", "nan", "inf", "-inf", "null", "none"];
    names.iter().any(|name| cell.eq_ignore_ascii_case(name))
}

/// Whether a row contains units: at least two cells are filled, and all filled cells are units or in brackets.
fn is_of_units(row: &Row) -> bool {
    let filled = || row.cells.iter().filter(|cell| !cell.is_empty());
    let is_bracketed = |cell: &str| cell.starts_with(['(', '[']) && cell.ends_with([')', ']']);
    filled().count() >= 2 && filled().all(|cell| is_bracketed(cell) || Unit::named(cell).is_some())
}

/// Splits a column name such as `Load (kN)`, `Load [kN]`, `Load / kN`, `load in kN` or `force_kN` into name and unit.
pub(super) fn name_and_unit(written: &str) -> (String, Option<String>) {
    let both = |name: &str, unit: &str| (name.trim().to_owned(), Some(unit.trim().to_owned()));
    for (opening, close) in [('(', ')'), ('[', ']'), ('{', '}')] {
        let inner =
            written.trim_end().strip_suffix(close).and_then(|rest| rest.rsplit_once(opening));
        if let Some((name, unit)) = inner {
            return both(name, unit);
        }
    }
    for separator in [" in ", "/", "_", " ", ","] {
        if let Some((name, unit)) = written.rsplit_once(separator)
            && !name.trim().is_empty()
            && Unit::named(unit).is_some()
        {
            return both(name, unit);
        }
    }
    (written.trim().to_owned(), None)
}
