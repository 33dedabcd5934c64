//! Files of curves, in CSV format.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::point::CurvePoint;
use crate::error::{CurveFileError, FemError};
use fem_file::open_regular;

/// Columns of a curve file: the first `REQUIRED` are mandatory, the others optional.
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
/// Numbers are written with enough digits for [`read_curve`] to return exactly the same numbers. The column
/// `balance_N_mm` contains [`CurvePoint::balance_n_mm`].
///
/// # Errors
/// [`FemError::Io`] if the file cannot be written.
pub fn write_curve(path: impl AsRef<Path>, curve: &[CurvePoint]) -> Result<(), FemError> {
    let mut writer = CurveWriter::create(path)?;
    curve.iter().try_for_each(|point| writer.push(point))
}

/// Writes a curve point by point: each point is in the file when [`push`](Self::push) returns.
///
/// The columns are the columns of [`write_curve`], followed by one column `d_force_d_<name>` per parameter of the
/// sensitivities, in N per unit of the parameter.
#[derive(Debug)]
pub struct CurveWriter {
    path: PathBuf,
    writer: csv::Writer<File>,
    parameters: usize,
}

impl CurveWriter {
    /// Creates the file and writes the header; an existing file is replaced.
    ///
    /// # Errors
    /// [`FemError::Io`] if the file cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, FemError> {
        Self::with_parameters(path, &[])
    }

    /// Creates the file with an additional column for each parameter name of [`Sensitivities`](crate::Sensitivities).
    ///
    /// # Errors
    /// The errors of [`create`](Self::create).
    pub fn with_parameters(path: impl AsRef<Path>, names: &[String]) -> Result<Self, FemError> {
        let path = path.as_ref().to_owned();
        let file = File::create(&path).map_err(|error| FemError::io("write", &path, error))?;
        let writer = csv::Writer::from_writer(file);
        let mut out = Self { path, writer, parameters: names.len() };
        let derivatives = names.iter().map(|name| format!("d_force_d_{name}"));
        out.write(COLUMNS.map(String::from).into_iter().chain(derivatives))?;
        Ok(out)
    }

    /// Writes a point.
    ///
    /// # Errors
    /// The errors of [`create`](Self::create).
    pub fn push(&mut self, p: &CurvePoint) -> Result<(), FemError> {
        self.push_differentiated(p, &[])
    }

    /// Writes a point with the derivatives of its force, a row of [`Sensitivities::force_n`](crate::Sensitivities).
    /// Cells without a derivative are empty.
    ///
    /// # Errors
    /// The errors of [`create`](Self::create).
    pub fn push_differentiated(
        &mut self,
        p: &CurvePoint,
        derivatives: &[f64],
    ) -> Result<(), FemError> {
        let cells = [
            p.time_s.to_string(),
            p.displacement_mm.to_string(),
            p.force_n.to_string(),
            p.elastic_n_mm.to_string(),
            p.fracture_n_mm.to_string(),
            p.viscous_n_mm.to_string(),
            p.phi_mean.to_string(),
            p.phi_max.to_string(),
            p.newton.to_string(),
            p.linear.to_string(),
            p.work_n_mm.to_string(),
            p.friction_n_mm.to_string(),
            p.balance_n_mm().to_string(),
            p.residual.to_string(),
        ];
        let cell = |k: usize| derivatives.get(k).map_or(String::new(), f64::to_string);
        self.write(cells.into_iter().chain((0..self.parameters).map(cell)))
    }

    fn write(&mut self, line: impl Iterator<Item = String>) -> Result<(), FemError> {
        let written = self.writer.write_record(line).map_err(std::io::Error::from);
        written
            .and_then(|()| self.writer.flush())
            .map_err(|error| FemError::io("write", &self.path, error))
    }
}

/// Reads a curve. Columns are identified by their names. The last six columns of [`write_curve`] are optional; unknown
/// columns are ignored.
///
/// # Errors
/// [`FemError::Io`] if the file cannot be read; [`FemError::CurveFile`] with the line and the column that is missing
/// or is not a number.
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
    let file = open_regular(path).map_err(|error| FemError::io("read", path, error))?;
    let wrong = |source| FemError::CurveFile { path: path.into(), source };
    let broken = |error: csv::Error| match error.is_io_error() {
        true => FemError::io("read", path, error.into()),
        false => wrong(CurveFileError::NotATable(Arc::new(error))),
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(file);
    let header = reader.headers().map_err(broken)?.clone();
    let absent = |name: &&&str| !header.iter().any(|h| h == **name);
    if let Some(column) = COLUMNS[..REQUIRED].iter().find(absent) {
        let header = COLUMNS[..REQUIRED].join(",");
        return Err(wrong(CurveFileError::MissingColumn { column, header }));
    }
    let mut curve = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let point = record.deserialize(Some(&header));
        curve.push(point.map_err(|error| wrong(not_a_number(&error, &header, &record)))?);
    }
    Ok(curve)
}

fn not_a_number(
    error: &csv::Error,
    header: &csv::StringRecord,
    record: &csv::StringRecord,
) -> CurveFileError {
    let field = match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.field(),
        _ => None,
    };
    let at = |record: &csv::StringRecord| {
        let text = field.and_then(|k| record.get(usize::try_from(k).ok()?));
        text.unwrap_or_default().to_owned()
    };
    CurveFileError::NotANumber {
        line: record.position().map_or(0, csv::Position::line),
        column: at(header),
        text: at(record),
    }
}
