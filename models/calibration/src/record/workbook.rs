//! A sheet of an Excel workbook (`.xlsx`) as rows of cells.

use std::io::Cursor;
use std::path::Path;

use calamine::{Data, Reader, Xlsx};

use super::number::Decimal;
use super::options::ReadOptions;
use super::text::{Row, Sheet};
use crate::error::InputError;

/// Reads the sheet that the options name, or else the first sheet.
///
/// # Errors
/// If the file is not a workbook, or does not contain the sheet.
pub(super) fn sheet(
    file: &Path,
    bytes: Vec<u8>,
    options: &ReadOptions,
) -> Result<Sheet, InputError> {
    let unreadable = |e: calamine::XlsxError| {
        let help = "Save the workbook as .xlsx, or export the readings as text.";
        InputError::new(file, "", "", format!("is not a readable workbook ({e})"), help)
    };
    let mut workbook = Xlsx::new(Cursor::new(bytes)).map_err(unreadable)?;
    let names = workbook.sheet_names();
    let name = match &options.sheet {
        Some(name) if names.contains(name) => name.clone(),
        Some(name) => {
            let help = format!("The sheets are: {}.", names.join(", "));
            return Err(InputError::new(file, "sheet", name, "is not in the workbook", help));
        }
        None => names.first().cloned().unwrap_or_default(),
    };
    let range = workbook.worksheet_range(&name).map_err(unreadable)?;
    let first = range.start().map_or(0, |(row, _)| row as usize);
    let rows = range
        .rows()
        .enumerate()
        .map(|(i, cells)| Row { line: first + i + 1, cells: cells.iter().map(text).collect() });
    let filled = |row: &Row| row.cells.iter().any(|cell| !cell.is_empty());
    let understood = vec![format!("sheet {name:?}")];
    let rows = rows.filter(filled).collect();
    Ok(Sheet { rows, decimal: Decimal::Point, is_decimal_certain: false, understood })
}

/// Formats a cell as text with a decimal point. A date or a duration becomes a clock time in hours, minutes and seconds,
/// because differences of times are sufficient for the rate of a test.
fn text(cell: &Data) -> String {
    match cell {
        Data::Float(number) => number.to_string(),
        Data::Int(number) => number.to_string(),
        Data::String(text) => text.trim().to_owned(),
        Data::Empty => String::new(),
        Data::DateTime(days) => {
            let seconds = days.as_f64() * 86_400.0;
            let (hours, rest) = ((seconds / 3600.0).floor(), seconds.rem_euclid(3600.0));
            format!("{hours}:{}:{:.6}", (rest / 60.0).floor(), (rest % 60.0).min(59.999_999))
        }
        other => other.to_string(),
    }
}
