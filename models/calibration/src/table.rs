//! Reads and writes small CSV tables. Errors name line, column and value.

use std::borrow::Cow;
use std::path::Path;

use crate::error::{InputError, closest};

/// Table of text cells with named columns, held in memory as a whole.
#[derive(Debug)]
pub struct CsvTable<'a> {
    file: &'a Path,
    columns: Vec<String>,
    /// For each row, the line number in the file (from 1) and the cells.
    rows: Vec<(u64, Vec<String>)>,
    /// Whether numbers are written as `4,95`.
    pub(crate) has_decimal_comma: bool,
}

impl<'a> CsvTable<'a> {
    /// Reads `file` and checks that it has the `required` columns.
    pub fn read(file: &'a Path, required: &[&str]) -> Result<Self, InputError> {
        let bytes = fem_file::read_regular(file)
            .map_err(|e| InputError::unreadable(file, &e, "Check its name and folder."))?;
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
        Self::parse(file, bytes, b',', required)
    }

    /// Parses UTF-8 text with this separator and checks that it has the `required` columns. Rows with only empty cells
    /// are skipped.
    pub(crate) fn parse(
        file: &'a Path,
        bytes: &[u8],
        separator: u8,
        required: &[&str],
    ) -> Result<Self, InputError> {
        let bytes = with_line_feeds(bytes);
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(&*bytes);
        let columns: Vec<String> = match reader.headers() {
            Ok(header) => header.iter().map(str::to_owned).collect(),
            Err(e) => return Err(malformed(file, &bytes, &e)),
        };
        let twice = |(i, name): (usize, &String)| !name.is_empty() && columns[..i].contains(name);
        if let Some(i) = columns.iter().enumerate().position(twice) {
            let help = "Give each column a different name.";
            return Err(InputError::new(file, "line 1, column", &columns[i], "occurs twice", help));
        }
        for &column in required {
            if !columns.iter().any(|c| c == column) {
                return Err(missing_column(file, column, &columns, required));
            }
        }
        let mut rows = Vec::new();
        let mut lines = LineCounter { text: &bytes, start: 0, line: 1 };
        for record in reader.records() {
            let record = record.map_err(|e| malformed(file, &bytes, &e))?;
            let line = record.position().map_or(0, |position| lines.line_at(position.byte()));
            if record.iter().any(|cell| !cell.is_empty()) {
                rows.push((line, record.iter().map(str::to_owned).collect()));
            }
        }
        Ok(Self { file, columns, rows, has_decimal_comma: false })
    }

    /// Returns the first row whose cell under `column` is `text`.
    pub fn named(&self, column: &str, text: &str) -> Result<TableRow<'_>, InputError> {
        self.rows().find(|row| row.text(column) == text).ok_or_else(|| {
            InputError::new(self.file, text, "", "has no line", "Run the stages again.")
        })
    }

    pub fn has_column(&self, column: &str) -> bool {
        self.columns.iter().any(|name| name == column)
    }

    /// Names of the columns in their order.
    pub fn columns(&self) -> impl ExactSizeIterator<Item = &str> {
        self.columns.iter().map(String::as_str)
    }

    pub fn rows(&self) -> impl Iterator<Item = TableRow<'_>> {
        (0..self.rows.len()).map(move |index| TableRow { table: self, index })
    }
}

/// One line of a [`CsvTable`].
#[derive(Clone, Copy, Debug)]
pub struct TableRow<'a> {
    table: &'a CsvTable<'a>,
    index: usize,
}

impl<'a> TableRow<'a> {
    /// Cell under `column`; empty if the table has no such column.
    pub fn text(&self, column: &str) -> &'a str {
        let column_index = self.table.columns.iter().position(|c| c == column);
        column_index.map_or("", |i| &self.table.rows[self.index].1[i])
    }

    pub fn number(&self, column: &str) -> Result<f64, InputError> {
        let (text, comma) = (self.text(column), self.table.has_decimal_comma);
        let number = match comma {
            true if text.contains('.') => None,
            true => text.replace(',', ".").parse::<f64>().ok(),
            false => text.parse().ok(),
        };
        number.filter(|value| value.is_finite()).ok_or_else(|| {
            let help = match comma {
                true => "Write the number with a decimal comma, like the other numbers, and without a unit: 4,95.",
                false => "Write the number with a decimal point and without a unit: 4.95.",
            };
            self.error(column, "is not a finite number", help)
        })
    }

    pub fn positive(&self, column: &str) -> Result<f64, InputError> {
        let value = self.number(column)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.error(column, "must be positive", "Check the sign and the column."))
        }
    }

    /// Creates an error at this line and `column`.
    pub fn error(&self, column: &str, problem: &str, help: &str) -> InputError {
        let line = self.table.rows[self.index].0;
        let location = format!("line {line}, column {column}");
        InputError::new(self.table.file, location, self.text(column), problem, help)
    }
}

/// Counter of the lines of a text. The CSV reader gives the position of a record as the end of the preceding record;
/// blank lines and comments may follow this position before the record starts.
struct LineCounter<'a> {
    text: &'a [u8],
    /// Byte offset of the start of the current line; `line` is its number.
    start: usize,
    line: u64,
}

impl LineCounter<'_> {
    /// Line number of the first row at or after the position `byte`. Positions must not decrease from one call to the
    /// next.
    fn line_at(&mut self, byte: u64) -> u64 {
        let byte = usize::try_from(byte).unwrap_or(usize::MAX);
        while self.start < self.text.len() {
            let rest = &self.text[self.start..];
            let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
            let row = rest[..length].trim_ascii();
            let is_skipped = row.is_empty() || row.starts_with(b"#");
            if self.start + length >= self.text.len() || (self.start >= byte && !is_skipped) {
                break;
            }
            self.start += length + 1;
            self.line += 1;
        }
        self.line
    }
}

/// Converts all line endings to line feeds, by which the reader counts lines.
fn with_line_feeds(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.contains(&b'\r') {
        return Cow::Borrowed(bytes);
    }
    let mut text = Vec::with_capacity(bytes.len());
    for (i, &byte) in bytes.iter().enumerate() {
        match byte {
            b'\r' if bytes.get(i + 1) == Some(&b'\n') => {}
            b'\r' => text.push(b'\n'),
            other => text.push(other),
        }
    }
    Cow::Owned(text)
}

/// Formats a header and rows of cells as CSV.
pub fn to_csv<H, R>(header: H, rows: impl IntoIterator<Item = R>) -> std::io::Result<Vec<u8>>
where
    H: IntoIterator<Item: AsRef<[u8]>>,
    R: IntoIterator<Item: AsRef<[u8]>>,
{
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header)?;
    for row in rows {
        writer.write_record(row)?;
    }
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

fn missing_column(file: &Path, column: &str, header: &[String], required: &[&str]) -> InputError {
    let help = if header.len() == 1 && header[0].contains([';', '\t']) {
        "Separate columns by commas and write numbers with a decimal point.".to_owned()
    } else if let Some(similar) = closest(column, header.iter().map(String::as_str)) {
        format!("Did you mean the column {similar:?}? The header is {}.", required.join(","))
    } else {
        format!("The first line must be the header {}.", required.join(","))
    };
    InputError::new(file, "line 1", "", format!("the column {column} is missing"), help)
}

fn malformed(file: &Path, text: &[u8], error: &csv::Error) -> InputError {
    let line =
        |position: &csv::Position| LineCounter { text, start: 0, line: 1 }.line_at(position.byte());
    let location = error.position().map_or(String::new(), |p| format!("line {}", line(p)));
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => InputError::new(
            file,
            location,
            "",
            format!("has {len} fields, the header has {expected_len}"),
            "Write numbers with a decimal point, not a comma, and write every field.",
        ),
        _ => InputError::new(
            file,
            location,
            "",
            format!("is not readable CSV ({error})"),
            "Save the table as plain text in UTF-8, with fields separated by commas.",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_alike_with_every_line_ending() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("t.csv");
        for ending in ["\n", "\r\n", "\r"] {
            let text = ["# made in May", "a,b", "1,2", "", "3,x", ""].join(ending);
            std::fs::write(&file, text).unwrap();
            let table = CsvTable::read(&file, &["a", "b"]).unwrap();
            let error = table.rows().find_map(|row| row.number("b").err()).unwrap();
            assert_eq!(error.place, "line 5, column b", "{ending:?}");
        }
    }
}
