//! Records of testing machines, read as displacement in mm, force in N and time in s.
//!
//! A record is an Excel workbook or a text. Separator, decimal sign, encoding, lines before the header, and a row of
//! units are detected unless `[experiments.read]` states them. [`Record::understood`] describes the detected format.

mod aliases;
mod columns;
mod header;
mod number;
mod options;
mod text;
mod unit;
mod workbook;

use std::path::Path;

use crate::error::InputError;
pub(crate) use columns::is_time_column;
use columns::{Column, Columns};
use header::Layout;
pub use number::Decimal;
pub use options::{Compression, Encoding, ReadOptions, Separator};
use text::Sheet;
pub(crate) use text::decoded;
use unit::Dimension;

/// Size of a specimen, with which stress and strain are converted to force and displacement.
#[derive(Clone, Copy, Debug)]
pub struct SpecimenSize {
    pub height_mm: f64,
    pub radius_mm: f64,
}

/// Record of one test, compression positive.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub displacement_mm: Vec<f64>,
    pub force_n: Vec<f64>,
    pub time_s: Option<Vec<f64>>,
    /// Description of the format of the file: `separator ;, decimal comma, 4 header lines, …`.
    pub understood: String,
}

impl Record {
    /// Reads a text export or a workbook (`.xlsx`).
    ///
    /// # Errors
    /// If there is no column of displacement or force, or more than one column of a kind, a unit is missing or unknown, or
    /// a cell is not a number. The error names file, line, column, value and help.
    pub fn read(
        file: &Path,
        options: &ReadOptions,
        size: SpecimenSize,
    ) -> Result<Self, InputError> {
        let bytes = fem_file::read_regular(file)
            .map_err(|e| InputError::unreadable(file, &e, "Check its name and folder."))?;
        let is_workbook = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("xlsx"));
        let sheet = match is_workbook {
            true => workbook::sheet(file, bytes, options)?,
            false => Sheet::of_text(file, &bytes, options)?,
        };
        let layout = Layout::of(file, &sheet, options)?;
        let columns = Columns::of(file, &layout, options)?;
        let mut understood = sheet.understood.clone();
        understood.push(match layout.header_lines {
            1 => "1 header line".to_owned(),
            lines => format!("{lines} header lines"),
        });
        understood.extend(layout.after_readings.clone());
        let mut displacement_mm = columns.displacement.read(file, &layout, &sheet)?;
        let mut force_n = columns.force.read(file, &layout, &sheet)?;
        let time = columns.time.as_ref();
        let time_s = time.map(|column| column.read(file, &layout, &sheet)).transpose()?;
        understood.push(converted(&mut displacement_mm, &columns.displacement, size));
        understood.push(converted(&mut force_n, &columns.force, size));
        understood.extend(time.map(|column| column.described("time")));
        understood.extend(with_compression_positive(&mut displacement_mm, &mut force_n, options));
        understood.extend(zeroed(&mut displacement_mm, &mut force_n, options));
        Ok(Self { displacement_mm, force_n, time_s, understood: understood.join(", ") })
    }
}

/// Converts strain to displacement and stress to force in place. Returns a description of the column.
fn converted(values: &mut [f64], column: &Column, size: SpecimenSize) -> String {
    let SpecimenSize { height_mm, radius_mm } = size;
    let area_mm2 = std::f64::consts::PI * radius_mm * radius_mm;
    let (role, factor, by) = match column.dimension {
        Dimension::Strain => ("strain", height_mm, format!(" times the height of {height_mm} mm")),
        Dimension::Stress => ("stress", area_mm2, format!(" times the area of {area_mm2:.4} mm²")),
        Dimension::Length => ("displacement", 1.0, String::new()),
        Dimension::Force => ("load", 1.0, String::new()),
        Dimension::Time => ("time", 1.0, String::new()),
    };
    values.iter_mut().for_each(|value| *value *= factor);
    column.described(role) + &by
}

/// Changes signs so that compressive forces and the displacement of the platen are positive. Returns descriptions of
/// the changes.
fn with_compression_positive(
    displacement_mm: &mut [f64],
    force_n: &mut [f64],
    options: &ReadOptions,
) -> Vec<String> {
    let size = |i: &usize| force_n[*i].abs();
    let largest = (0..force_n.len()).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let turn = |values: &mut [f64]| values.iter_mut().for_each(|value| *value = -*value);
    let is_negative = match options.compression {
        Some(compression) => compression == Compression::Negative,
        None => force_n.get(largest).is_some_and(|&force| force < 0.0),
    };
    let mut understood = Vec::new();
    if is_negative {
        turn(force_n);
        understood.push("compression negative".to_owned());
    }
    let falls = displacement_mm.get(largest).zip(displacement_mm.first());
    if falls.is_some_and(|(at_peak, first)| at_peak < first) {
        turn(displacement_mm);
        understood.push("displacement negative".to_owned());
    }
    understood
}

/// Subtracts the first readings from force and displacement if `options` request it. Returns descriptions of the
/// changes.
fn zeroed(displacement_mm: &mut [f64], force_n: &mut [f64], options: &ReadOptions) -> Vec<String> {
    let mut understood = Vec::new();
    if options.zero_force && !force_n.is_empty() {
        let count = (force_n.len() / 200).clamp(1, 25);
        let mut first = force_n[..count].to_vec();
        first.sort_unstable_by(f64::total_cmp);
        let zero = first[count / 2];
        force_n.iter_mut().for_each(|force| *force -= zero);
        understood.push(format!("load counted from {zero:.4} N"));
    }
    if let Some(&zero) = displacement_mm.first().filter(|_| options.zero_displacement) {
        displacement_mm.iter_mut().for_each(|u| *u -= zero);
        understood.push(format!("displacement counted from {zero:.4} mm"));
    }
    understood
}

#[cfg(test)]
mod tests;
