//! Tables saved from a spreadsheet: separator, decimal sign and encoding are detected.

use std::path::Path;

use crate::error::InputError;
use crate::record::decoded;
use crate::table::CsvTable;

/// Separators and their names, in order of preference.
const SEPARATORS: [(u8, &str); 3] = [(b',', ","), (b';', ";"), (b'\t', "tab")];

/// Table with a description of its format (`understood`). The description is `None` for a table with commas as
/// separators, decimal points and UTF-8.
#[derive(Debug)]
pub struct DetectedTable<'a> {
    pub table: CsvTable<'a>,
    pub understood: Option<String>,
}

impl<'a> DetectedTable<'a> {
    /// Reads `file` and checks that it has the `required` columns. A first line such as `sep=;` states the separator.
    /// Otherwise, the separator is chosen with which the header contains most of the required columns. The decimal
    /// sign is the sign that most cells of the columns `numeric_columns` contain.
    ///
    /// # Errors
    /// The errors of [`CsvTable::read`].
    pub fn read(
        file: &'a Path,
        required: &[&str],
        numeric_columns: &[&str],
    ) -> Result<Self, InputError> {
        let bytes = fem_file::read_regular(file)
            .map_err(|e| InputError::unreadable(file, &e, "Check its name and folder."))?;
        let (text, encoding) = decoded(file, &bytes, None)?;
        let (text, stated) = without_separator_line(text);
        let (separator, name) = stated.unwrap_or_else(|| separator(&text, required));
        let mut table = CsvTable::parse(file, text.as_bytes(), separator, required)?;
        let cells =
            || table.rows().flat_map(|row| numeric_columns.iter().map(move |name| row.text(name)));
        let has = |sign: char, other: char| {
            cells().filter(|cell| cell.contains(sign) && !cell.contains(other)).count()
        };
        let has_decimal_comma = has(',', '.') > has('.', ',');
        table.has_decimal_comma = has_decimal_comma;
        let mut understood = Vec::new();
        if separator != b',' {
            understood.push(format!("separator {name}"));
        }
        if has_decimal_comma {
            understood.push("decimal comma".to_owned());
        }
        understood.extend(encoding.map(str::to_owned));
        let understood = (!understood.is_empty()).then(|| understood.join(", "));
        Ok(Self { table, understood })
    }
}

/// Turns a first line such as `sep=;`, which spreadsheets write, into a comment. Returns the text and the stated
/// separator.
fn without_separator_line(text: String) -> (String, Option<(u8, &'static str)>) {
    let first = text.lines().next().unwrap_or_default();
    let stated = first.trim_matches('"').strip_prefix("sep=").and_then(|rest| {
        let byte = rest.bytes().next()?;
        SEPARATORS.into_iter().find(|(separator, _)| *separator == byte)
    });
    match stated {
        Some(_) => (format!("#{text}"), stated),
        None => (text, None),
    }
}

/// Detects the separator: the separator with which the header contains most of the required columns. If this number is
/// equal for several separators, the most frequent separator is chosen.
fn separator(text: &str, required: &[&str]) -> (u8, &'static str) {
    let is_header = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let header = text.split(['\n', '\r']).find(is_header).unwrap_or_default();
    let matches = |separator: u8| {
        let cells = || header.split(char::from(separator));
        let names = cells().map(|cell| cell.trim().trim_matches('"').trim());
        (names.filter(|name| required.contains(name)).count(), cells().count())
    };
    let mut best = SEPARATORS[0];
    for other in SEPARATORS {
        if matches(other.0) > matches(best.0) {
            best = other;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    const REQUIRED: [&str; 2] = ["id", "height_mm"];
    const PLAIN: &str = "id,height_mm,note\nS-1,4.95,Größe\nS-2,5.05,\n";

    /// Rows of a table, and a description of its detected format.
    type Rows = (Vec<(String, f64, String)>, Option<String>);

    fn read(bytes: &[u8]) -> Result<Rows, InputError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let DetectedTable { table, understood } =
            DetectedTable::read(file.path(), &REQUIRED, &["height_mm"])?;
        let row = |row: crate::table::TableRow<'_>| {
            Ok((row.text("id").to_owned(), row.number("height_mm")?, row.text("note").to_owned()))
        };
        Ok((table.rows().map(row).collect::<Result<_, InputError>>()?, understood))
    }

    /// Files of one table that were saved by spreadsheets of several countries have the same rows.
    #[test]
    fn one_table_in_every_form_is_one_table() {
        let (plain, understood) = read(PLAIN.as_bytes()).unwrap();
        assert_eq!(plain[0], ("S-1".to_owned(), 4.95, "Größe".to_owned()));
        assert_eq!(understood, None);
        let german = PLAIN.replace(',', ";").replace('.', ",");
        let tabs = german.replace(';', "\t");
        let quoted =
            "\"id\",\"height_mm\",\"note\"\n\"S-1\",\"4,95\",\"Größe\"\n\"S-2\",\"5,05\",\"\"\n";
        let latin1 = |text: &str| text.chars().map(|c| c as u32 as u8).collect::<Vec<u8>>();
        let utf16 = |text: &str| {
            let units = text.encode_utf16().flat_map(u16::to_le_bytes);
            [0xff, 0xfe].into_iter().chain(units).collect::<Vec<u8>>()
        };
        let forms: [(Vec<u8>, Option<&str>); 9] = [
            (format!("\u{feff}{PLAIN}").into_bytes(), None),
            (PLAIN.replace('\n', "\r\n").into_bytes(), None),
            (PLAIN.replace(',', ";").into_bytes(), Some("separator ;")),
            (german.clone().into_bytes(), Some("separator ;, decimal comma")),
            (tabs.into_bytes(), Some("separator tab, decimal comma")),
            (quoted.as_bytes().to_vec(), Some("decimal comma")),
            (latin1(&german), Some("separator ;, decimal comma, Latin-1")),
            (utf16(&german), Some("separator ;, decimal comma, UTF-16")),
            (
                format!("\u{feff}sep=;\r\n{}\r\n;;\r\n", german.replace('\n', "\r\n")).into_bytes(),
                Some("separator ;, decimal comma"),
            ),
        ];
        for (bytes, how) in forms {
            let (rows, understood) = read(&bytes).unwrap();
            assert_eq!(rows, plain, "{how:?}");
            assert_eq!(understood.as_deref(), how);
        }
    }

    #[test]
    fn mistakes_have_the_lines_of_the_file() {
        let text = "sep=;\r\n# saved in May\r\nid;height_mm;note\r\nS-1;4,95;a\r\nS-2;5,05;b\r\nS-3;5.15;c\r\n";
        let error = read(text.as_bytes()).unwrap_err().to_string();
        for part in ["line 6, column height_mm = 5.15", "decimal comma"] {
            assert!(error.contains(part), "{part:?} is not in {error:?}");
        }
        let error = read(b"id;height\nS-1;4,95\n").unwrap_err().to_string();
        assert!(error.contains("height_mm is missing") && error.contains("\"height\""), "{error}");
    }
}
