//! Curves as CSV.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::curve::CurvePoint;
use crate::error::FemError;

/// The columns that every curve file has, then those that may be absent.
const COLUMNS: [&str; 14] = [
    "time_s",
    "displacement_mm",
    "force_N",
    "elastic_N_mm",
    "fracture_N_mm",
    "viscous_N_mm",
    "phi_mean",
    "phi_max",
    "newton",
    "linear",
    "work_N_mm",
    "friction_N_mm",
    "balance_N_mm",
    "residual",
];
const REQUIRED: usize = 8;

/// Writes a curve with the header
/// `time_s,displacement_mm,force_N,elastic_N_mm,fracture_N_mm,viscous_N_mm,phi_mean,phi_max,newton,linear,work_N_mm,friction_N_mm,balance_N_mm,residual`.
///
/// Numbers are written so that [`read_curve`] returns the same bits; the balance is
/// [`CurvePoint::balance_n_mm`].
///
/// # Errors
/// [`FemError::CurveFile`] when the file cannot be written.
pub fn write_curve(path: impl AsRef<Path>, curve: &[CurvePoint]) -> Result<(), FemError> {
    let mut writer = CurveWriter::create(path)?;
    curve.iter().try_for_each(|point| writer.push(point))
}

/// Writes a curve as it grows: every point is in the file once [`push`](Self::push) returns.
///
/// The columns are those of [`write_curve`].
#[derive(Debug)]
pub struct CurveWriter {
    path: PathBuf,
    writer: csv::Writer<File>,
}

impl CurveWriter {
    /// Starts a file, in place of one that is there.
    ///
    /// # Errors
    /// [`FemError::CurveFile`] when the file cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, FemError> {
        let path = path.as_ref().to_owned();
        let wrong = |e: csv::Error| file_error(&path, format!("cannot be written: {e}"));
        let mut writer = csv::Writer::from_path(&path).map_err(wrong)?;
        writer.write_record(COLUMNS).map_err(wrong)?;
        let mut out = Self { path, writer };
        out.flush()?;
        Ok(out)
    }

    /// Adds a point.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn push(&mut self, p: &CurvePoint) -> Result<(), FemError> {
        let values = [
            p.time_s,
            p.displacement_mm,
            p.force_n,
            p.elastic_n_mm,
            p.fracture_n_mm,
            p.viscous_n_mm,
            p.phi_mean,
            p.phi_max,
            f64::from(p.newton),
            f64::from(p.linear),
            p.work_n_mm,
            p.friction_n_mm,
            p.balance_n_mm(),
            p.residual,
        ];
        self.writer
            .write_record(values.map(|x| x.to_string()))
            .map_err(|e| file_error(&self.path, format!("cannot be written: {e}")))?;
        self.flush()
    }

    fn flush(&mut self) -> Result<(), FemError> {
        self.writer.flush().map_err(|e| file_error(&self.path, format!("cannot be written: {e}")))
    }
}

/// Reads a curve; columns are found by name, the last six may be absent, others are ignored.
///
/// # Errors
/// [`FemError::CurveFile`] naming the line and the column that is missing or is not a number.
///
/// # Example
/// ```
/// let file = tempfile::NamedTempFile::new().unwrap();
/// let point = fem::CurvePoint { displacement_mm: 0.1, force_n: 42.0, newton: 3, ..Default::default() };
/// fem::write_curve(file.path(), &[point]).unwrap();
/// assert_eq!(fem::read_curve(file.path()).unwrap(), [point]);
/// ```
pub fn read_curve(path: impl AsRef<Path>) -> Result<Vec<CurvePoint>, FemError> {
    let path = path.as_ref();
    let wrong = |e: csv::Error| file_error(path, format!("cannot be read: {e}"));
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(wrong)?;
    let header = reader.headers().map_err(wrong)?.clone();
    let place = COLUMNS.map(|name| header.iter().position(|h| h == name));
    if let Some(missing) = (0..REQUIRED).find(|&k| place[k].is_none()) {
        return Err(file_error(
            path,
            format!(
                "has no column '{}': the header must hold {}",
                COLUMNS[missing],
                COLUMNS[..REQUIRED].join(",")
            ),
        ));
    }
    let mut curve = Vec::new();
    for record in reader.records() {
        let record = record.map_err(wrong)?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut values = [0.0; COLUMNS.len()];
        for (k, value) in values.iter_mut().enumerate() {
            let Some(text) = place[k].and_then(|at| record.get(at)) else { continue };
            *value = text.parse().map_err(|_| {
                file_error(
                    path,
                    format!("line {line}, column '{}': '{text}' is not a number", COLUMNS[k]),
                )
            })?;
        }
        let [
            time_s,
            displacement_mm,
            force_n,
            elastic_n_mm,
            fracture_n_mm,
            viscous_n_mm,
            phi_mean,
            phi_max,
            newton,
            linear,
            work_n_mm,
            friction_n_mm,
            _,
            residual,
        ] = values;
        curve.push(CurvePoint {
            time_s,
            displacement_mm,
            force_n,
            elastic_n_mm,
            fracture_n_mm,
            viscous_n_mm,
            friction_n_mm,
            work_n_mm,
            phi_mean,
            phi_max,
            newton: newton as u32,
            linear: linear as u32,
            residual,
        });
    }
    Ok(curve)
}

fn file_error(path: &Path, message: String) -> FemError {
    FemError::CurveFile { path: path.display().to_string(), message }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_line_and_the_column() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("curve.csv");
        std::fs::write(&path, "time_s,displacement_mm\n0,0\n").unwrap();
        let message = read_curve(&path).unwrap_err().to_string();
        assert!(
            message.contains("no column 'force_N'") && message.contains("curve.csv"),
            "{message}"
        );
        let header = COLUMNS[..REQUIRED].join(",");
        std::fs::write(&path, format!("{header}\n0,0,0,0,0,0,0,0\n1,0,high,0,0,0,0,0\n")).unwrap();
        let message = read_curve(&path).unwrap_err().to_string();
        assert!(
            message.contains("line 3") && message.contains("'force_N'") && message.contains("high"),
            "{message}"
        );
        assert!(read_curve(dir.path().join("absent.csv")).is_err());
    }
}
