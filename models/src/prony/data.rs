//! Measured moduli of a relaxation test or a dynamic test, read from a table.

use std::path::Path;

use crate::error::InputError;

/// Measured moduli over time or frequency.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasuredModuli {
    /// Relaxation test: time in s and relaxation modulus in MPa.
    Relaxation(Vec<[f64; 2]>),
    /// Dynamic test (DMA): angular frequency in 1/s, storage modulus and loss modulus in MPa.
    Dynamic(Vec<[f64; 3]>),
}

/// Columns of a relaxation test.
const RELAXATION: [&str; 2] = ["time_s", "modulus_mpa"];
/// Columns of a dynamic test, with the frequency in Hz or as angular frequency.
const DYNAMIC: [&str; 3] = ["frequency_hz", "storage_mpa", "loss_mpa"];
const ANGULAR: &str = "angular_frequency_per_s";
/// Smallest number of rows.
const FEWEST: usize = 5;

impl MeasuredModuli {
    /// Reads a table in CSV format with the columns `time_s,modulus_mpa`, or `frequency_hz,storage_mpa,loss_mpa` (or
    /// `angular_frequency_per_s` instead of `frequency_hz`). Other columns are ignored.
    ///
    /// # Errors
    /// If the file cannot be read, a column is missing, there are fewer than five rows, or a value is not positive.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let error = |location: String, value: &str, problem: &str, help: &str| {
            InputError::new(path, location, value, problem, help)
        };
        let text = fem::read_regular_text(path).map_err(|source| {
            let problem = format!("cannot be read: {source}");
            error(String::new(), "", &problem, "Name a table in CSV format.")
        })?;
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let unreadable = |source: csv::Error| {
            let location = source.position().map(|at| format!("line {}", at.line()));
            let help =
                "Separate columns by commas, and give every row the columns of the first line.";
            let problem = format!("cannot be read: {source}");
            error(location.unwrap_or_default(), "", &problem, help)
        };
        let header = reader.headers().map_err(unreadable)?.clone();
        let column = |name: &str| header.iter().position(|column_name| column_name == name);
        let columns =
            |names: &[&str]| names.iter().map(|name| column(name)).collect::<Option<Vec<_>>>();
        let [hertz, storage, loss] = DYNAMIC;
        let (names, places, factor) = if let Some(places) = columns(&RELAXATION) {
            (RELAXATION.to_vec(), places, 1.0)
        } else if let Some(places) = columns(&DYNAMIC) {
            (DYNAMIC.to_vec(), places, 2.0 * std::f64::consts::PI)
        } else if let Some(places) = columns(&[ANGULAR, storage, loss]) {
            (vec![ANGULAR, storage, loss], places, 1.0)
        } else {
            let header_names: Vec<&str> = header.iter().collect();
            let help = format!(
                "Name the columns {}, or {hertz},{storage},{loss} ({ANGULAR} in place of {hertz}).",
                RELAXATION.join(",")
            );
            return Err(error("line 1".into(), &header_names.join(","), "lacks a column", &help));
        };
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(unreadable)?;
            let line = record.position().map_or(0, csv::Position::line);
            let mut row = Vec::with_capacity(places.len());
            for (name, &index) in names.iter().zip(&places) {
                let written = record.get(index).unwrap_or_default();
                let value = written.parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
                let Some(value) = value else {
                    let help = "Give a positive number; leave rows without a measured value out.";
                    let location = format!("line {line}, {name}");
                    return Err(error(location, written, "is not a positive number", help));
                };
                row.push(value);
            }
            row[0] *= factor;
            rows.push(row);
        }
        if rows.len() < FEWEST {
            let problem = format!("has {} rows; a fit needs at least {FEWEST}", rows.len());
            let help = "Measure at more times or frequencies, best over several decades.";
            return Err(error(String::new(), "", &problem, help));
        }
        let same = rows.iter().all(|row| row[0] == rows[0][0]);
        if same {
            let problem = format!("has the same {} in all rows", names[0]);
            let help = "Measure at several times or frequencies, best over several decades.";
            return Err(error(String::new(), "", &problem, help));
        }
        Ok(match names.len() {
            2 => Self::Relaxation(rows.iter().map(|row| [row[0], row[1]]).collect()),
            _ => Self::Dynamic(rows.iter().map(|row| [row[0], row[1], row[2]]).collect()),
        })
    }

    /// Returns the shortest and the longest time in s that the data cover. A dynamic test at the
    /// angular frequency ω covers the time 1/ω.
    pub(super) fn times_s(&self) -> [f64; 2] {
        let times: Vec<f64> = match self {
            Self::Relaxation(rows) => rows.iter().map(|row| row[0]).collect(),
            Self::Dynamic(rows) => rows.iter().map(|row| 1.0 / row[0]).collect(),
        };
        let least = times.iter().copied().fold(f64::INFINITY, f64::min);
        [least, times.into_iter().fold(0.0, f64::max)]
    }

    /// Returns the measured moduli in MPa, one after the other.
    pub(super) fn moduli(&self) -> Vec<f64> {
        match self {
            Self::Relaxation(rows) => rows.iter().map(|row| row[1]).collect(),
            Self::Dynamic(rows) => rows.iter().flat_map(|row| [row[1], row[2]]).collect(),
        }
    }

    /// Returns the relative standard deviation of one measured modulus, estimated from second differences of the logarithms
    /// in the order of time or frequency. A smooth dependence does not count as noise.
    pub(super) fn noise(&self) -> f64 {
        let columns: Vec<Vec<[f64; 2]>> = match self {
            Self::Relaxation(rows) => vec![rows.clone()],
            Self::Dynamic(rows) => {
                [1, 2].map(|k| rows.iter().map(|row| [row[0], row[k]]).collect()).to_vec()
            }
        };
        let (mut squares, mut count) = (0.0, 0.0_f64);
        for mut column in columns {
            column.sort_by(|a, b| a[0].total_cmp(&b[0]));
            for triple in column.windows(3) {
                let [a, b, c] = [0, 1, 2].map(|i| triple[i][1].ln());
                // the variance of a − 2b + c is six times the variance of one value
                squares += (a - 2.0 * b + c).powi(2) / 6.0;
                count += 1.0;
            }
        }
        (squares / count.max(1.0)).sqrt()
    }

    /// Returns the contribution of the long-term modulus to each measured modulus, per MPa.
    pub(super) fn long_term(&self) -> Vec<f64> {
        match self {
            Self::Relaxation(rows) => vec![1.0; rows.len()],
            Self::Dynamic(rows) => rows.iter().flat_map(|_| [1.0, 0.0]).collect(),
        }
    }

    /// Returns the contribution of a term with the relaxation time `time_s` to each measured modulus, per MPa, and its
    /// derivative with respect to ln τ.
    pub(super) fn term(&self, time_s: f64) -> [Vec<f64>; 2] {
        match self {
            Self::Relaxation(rows) => {
                let decay = |row: &[f64; 2]| (-row[0] / time_s).exp();
                let slope = |row: &[f64; 2]| row[0] / time_s * decay(row);
                [rows.iter().map(decay).collect(), rows.iter().map(slope).collect()]
            }
            Self::Dynamic(rows) => {
                let (mut values, mut slopes) = (Vec::new(), Vec::new());
                for row in rows {
                    let x = row[0] * time_s;
                    let below = 1.0 + x * x;
                    values.extend([x * x / below, x / below]);
                    slopes.extend([2.0 * x * x / below.powi(2), x * (1.0 - x * x) / below.powi(2)]);
                }
                [values, slopes]
            }
        }
    }
}
