//! Text exports as rows of cells: encoding, separator, decimal sign.

use std::path::Path;

use super::options::{Decimal, Encoding, ReadOptions, Separator};
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
        let mut understood = vec![format!("separator {}", separator.name())];
        understood.push(decimal.name().to_owned());
        understood.extend(encoding.map(str::to_owned));
        Ok(Self { rows: rows.collect(), decimal, understood })
    }
}

/// Score of a line as a row of readings: 2 if it has at least two numbers and all filled cells are numbers, 1 if it has
/// at least two numbers and at least half of the filled cells are numbers, else 0.
fn score(cells: &[String], decimal: Decimal) -> usize {
    let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
    let numbers = cells.iter().filter(|cell| decimal.number(cell).is_some()).count();
    match numbers {
        ..2 => 0,
        _ if numbers == filled => 2,
        _ if 2 * numbers >= filled => 1,
        _ => 0,
    }
}

/// Whether a row has readings.
pub(super) fn has_readings(row: &Row, decimal: Decimal) -> bool {
    score(&row.cells, decimal) > 0
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

impl Decimal {
    fn name(self) -> &'static str {
        match self {
            Self::Point => "decimal point",
            Self::Comma => "decimal comma",
        }
    }
}
