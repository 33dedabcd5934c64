//! Text exports as rows of cells: encoding, separator, decimal sign.

use std::path::Path;

use super::number::{Decimal, is_decimal_sign_certain, single_group};
use super::options::{Encoding, ReadOptions, Separator};
use crate::error::InputError;

/// One row of cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Line of the file, or row of the sheet, from 1.
    pub(super) line: usize,
    pub(super) cells: Vec<String>,
}

/// Rows of cells, without blank rows and comments (`#`).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sheet {
    pub(super) rows: Vec<Row>,
    pub(super) decimal: Decimal,
    /// Whether a cell proves the decimal sign. If so, the other sign separates thousands, also in `1,234`.
    pub(super) is_decimal_certain: bool,
    /// Descriptions of the detected format.
    pub(super) understood: Vec<String>,
}

/// Separators and decimal signs, in the order in which they are preferred.
const FORMATS: [(Separator, Decimal); 8] = [
    (Separator::Tab, Decimal::Point),
    (Separator::Tab, Decimal::Comma),
    (Separator::Semicolon, Decimal::Point),
    (Separator::Semicolon, Decimal::Comma),
    (Separator::Comma, Decimal::Point),
    (Separator::Comma, Decimal::Comma),
    (Separator::Space, Decimal::Point),
    (Separator::Space, Decimal::Comma),
];

impl Sheet {
    /// Splits a text into rows of cells.
    ///
    /// # Errors
    /// If the bytes are not text of the stated encoding, or no line has two numbers.
    pub(super) fn of_text(
        file: &Path,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Result<Self, InputError> {
        let (text, encoding) = decoded(file, bytes, options.encoding)?;
        // a lone carriage return ends a line, too
        let text = text.replace("\r\n", "\n").replace('\r', "\n");
        let lines = text.split('\n').enumerate().map(|(i, line)| (i + 1, line));
        let lines: Vec<(usize, &str)> = lines
            .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
            .collect();
        let is_possible = |(separator, decimal): &(Separator, Decimal)| {
            options.separator.is_none_or(|stated| stated == *separator)
                && options.decimal.is_none_or(|stated| stated == *decimal)
        };
        let mut best = None;
        for format in FORMATS.into_iter().filter(is_possible) {
            let (separator, decimal) = format;
            let score = lines.iter().map(|(_, line)| score(&split(line, separator), decimal)).sum();
            if best.is_none_or(|(_, most): (_, usize)| score > most) {
                best = Some((format, score));
            }
        }
        let Some(((separator, decimal), _)) = best.filter(|(_, score)| *score > 0) else {
            return Err(InputError::new(
                file,
                "",
                "",
                "has no line with two numbers",
                "Export the readings as text, one line per reading, or state separator and decimal under \
                 [experiments.read].",
            ));
        };
        let rows =
            lines.iter().map(|(line, text)| Row { line: *line, cells: split(text, separator) });
        let rows: Vec<Row> = rows.collect();
        let is_stated = options.decimal.is_some();
        let is_decimal_certain =
            is_stated || is_decimal_sign_certain(rows.iter().flat_map(|row| &row.cells), decimal);
        if !is_decimal_certain {
            check_groups(file, &rows, decimal)?;
        }
        let mut understood = vec![format!("separator {}", separator.name())];
        understood.push(decimal.name().to_owned());
        understood.extend(encoding.map(str::to_owned));
        Ok(Self { rows, decimal, is_decimal_certain, understood })
    }

    /// Parses a cell as a finite number; `None` if it is not a finite number.
    pub(super) fn number(&self, cell: &str) -> Option<f64> {
        let number = self.decimal.number(cell);
        number.or_else(|| {
            self.is_decimal_certain.then(|| single_group(cell, self.decimal.other())).flatten()
        })
    }

    /// Whether a row has readings.
    pub(super) fn has_readings(&self, row: &Row) -> bool {
        score_by(&row.cells, |cell| self.number(cell).is_some()) > 0
    }
}

/// Returns an error for a column in which the detected decimal sign may separate thousands: some numbers have the sign
/// before exactly three digits, and others are whole numbers of three digits, as in `980`, `1,020`.
fn check_groups(file: &Path, rows: &[Row], decimal: Decimal) -> Result<(), InputError> {
    let is_hundreds = |cell: &str| cell.len() == 3 && cell.bytes().all(|b| b.is_ascii_digit());
    let width = rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
    for column in 0..width {
        let cells =
            || rows.iter().filter_map(move |row| Some((row.line, row.cells.get(column)?.trim())));
        let Some((line, cell)) = cells().find(|(_, cell)| single_group(cell, decimal).is_some())
        else {
            continue;
        };
        if cells().any(|(_, cell)| is_hundreds(cell.trim_start_matches('-'))) {
            let location = format!("line {line}, column {}", column + 1);
            let problem = "may have a decimal sign or a separator of thousands";
            let help = "Write decimal = \".\" or decimal = \",\" under [experiments.read].";
            return Err(InputError::new(file, location, cell, problem, help));
        }
    }
    Ok(())
}

/// Score of a line as a row of readings: 2 if it has at least two numbers and all filled cells are numbers, 1 if it has
/// at least two numbers and at least half of the filled cells are numbers, else 0.
fn score(cells: &[String], decimal: Decimal) -> usize {
    score_by(cells, |cell| decimal.number(cell).is_some())
}

fn score_by(cells: &[String], is_number: impl Fn(&str) -> bool) -> usize {
    let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
    let numeric_cells = cells.iter().filter(|cell| is_number(cell)).count();
    match numeric_cells {
        ..2 => 0,
        _ if numeric_cells == filled => 2,
        _ if 2 * numeric_cells >= filled => 1,
        _ => 0,
    }
}

/// Splits a line into cells, and removes the quotes around each cell.
fn split(line: &str, separator: Separator) -> Vec<String> {
    if separator == Separator::Space {
        return line.split_whitespace().map(|cell| cell.trim_matches('"').to_owned()).collect();
    }
    let mark = match separator {
        Separator::Comma => ',',
        Separator::Semicolon => ';',
        Separator::Tab | Separator::Space => '\t',
    };
    let (mut cells, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
    for character in line.chars() {
        match character {
            '"' => is_quoted = !is_quoted,
            _ if character == mark && !is_quoted => cells.push(std::mem::take(&mut cell)),
            _ => cell.push(character),
        }
    }
    cells.push(cell);
    cells.iter().map(|cell| cell.trim().to_owned()).collect()
}

/// Decodes a text. Also returns the name of the encoding; `None` for UTF-8.
pub(crate) fn decoded(
    file: &Path,
    bytes: &[u8],
    encoding: Option<Encoding>,
) -> Result<(String, Option<&'static str>), InputError> {
    let wrong = |name: &str| {
        let help = "State encoding = \"utf-8\", \"utf-16\" or \"latin-1\" under [experiments.read], or leave it \
                    out.";
        InputError::new(file, "", "", format!("is not {name} text"), help)
    };
    let utf16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        String::from_utf16(&units.collect::<Vec<_>>()).map_err(|_| wrong("UTF-16"))
    };
    match (encoding, bytes) {
        (None | Some(Encoding::Utf16), [0xff, 0xfe, rest @ ..]) => {
            Ok((utf16(rest, u16::from_le_bytes)?, Some("UTF-16")))
        }
        (None | Some(Encoding::Utf16), [0xfe, 0xff, rest @ ..]) => {
            Ok((utf16(rest, u16::from_be_bytes)?, Some("UTF-16")))
        }
        (None | Some(Encoding::Utf16), _) if utf16_without_mark(bytes).is_some() => {
            let unit = utf16_without_mark(bytes).unwrap_or(u16::from_le_bytes);
            Ok((utf16(bytes, unit)?, Some("UTF-16 without byte order mark")))
        }
        (Some(Encoding::Utf16), _) => Err(wrong("UTF-16")),
        (Some(Encoding::Latin1), _) => Ok((latin1(bytes), Some("Latin-1"))),
        (None | Some(Encoding::Utf8), _) => {
            let bare = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
            match (std::str::from_utf8(bare), encoding) {
                (Ok(text), _) => Ok((text.to_owned(), None)),
                (Err(_), None) => Ok((latin1(bytes), Some("Latin-1"))),
                (Err(_), Some(_)) => Err(wrong("UTF-8")),
            }
        }
    }
}

/// Byte order of UTF-16 text without a byte order mark; `None` if the bytes are other text. Most characters of an export
/// are ASCII, so that one byte of most pairs is zero; other encodings have no zero bytes.
fn utf16_without_mark(bytes: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    let pairs = bytes.len() / 2;
    let zeros = |place: usize| bytes.chunks_exact(2).filter(|pair| pair[place] == 0).count();
    let [big, little] = [zeros(0), zeros(1)];
    if bytes.len() % 2 == 1 {
        None
    } else if 2 * little > pairs && big == 0 {
        Some(u16::from_le_bytes)
    } else if 2 * big > pairs && little == 0 {
        Some(u16::from_be_bytes)
    } else {
        None
    }
}

/// Decodes ISO 8859-1, in which each byte is the code point of a character.
fn latin1(bytes: &[u8]) -> String {
    bytes.iter().copied().map(char::from).collect()
}

impl Separator {
    fn name(self) -> &'static str {
        match self {
            Self::Comma => ",",
            Self::Semicolon => ";",
            Self::Tab => "tab",
            Self::Space => "space",
        }
    }
}
