//! Reads the table of specimens and the curve of each specimen, and collects all mistakes.

use std::path::{Path, PathBuf};

use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable, TestCurve, curve_file};
use crate::record::{ReadOptions, Record, SpecimenSize, is_time_column};
use crate::same_test::SameTest;
use crate::table::{CsvTable, TableRow};
use crate::table_format::DetectedTable;

/// File name extensions of curves, in the order in which they are searched.
const ENDINGS: [&str; 6] = ["csv", "txt", "tsv", "dat", "asc", "xlsx"];

/// Columns of the table with numbers.
const NUMBERS: [&str; 4] = ["height_mm", "radius_mm", "slope_fraction", "rate_mm_per_s"];

/// Table of specimens with their curves, and the mistakes in these files.
#[derive(Debug, Default)]
pub struct SpecimenFiles {
    /// Specimens without mistakes, with their curves.
    pub table: SpecimenTable,
    /// Description of the format of the table; `None` for commas as separators, decimal points and UTF-8.
    pub table_understood: Option<String>,
    /// For each specimen of `table`, a description of the format of the curve; `None` for a plain file with the columns
    /// `displacement_mm,force_N`.
    pub understood: Vec<Option<String>>,
    /// All mistakes in the table, and the first mistake in each curve.
    pub mistakes: Vec<InputError>,
}

impl SpecimenFiles {
    /// Reads a table and, from `curves/` beside it, the curve of each specimen.
    pub fn read(file: &Path, options: &ReadOptions) -> Self {
        let mut read = Self::default();
        let required = ["id", "height_mm", "radius_mm", "group"];
        let table = match DetectedTable::read(file, &required, &NUMBERS) {
            Ok(DetectedTable { table, understood }) => {
                read.table_understood = understood;
                table
            }
            Err(mistake) => {
                read.mistakes.push(mistake);
                return read;
            }
        };
        let mut ids: Vec<String> = Vec::new();
        for row in table.rows() {
            let before = read.mistakes.len();
            let specimen = read.row(file, row, &ids, options);
            ids.push(row.text("id").to_owned());
            if let (Some((specimen, how)), true) = (specimen, read.mistakes.len() == before) {
                read.table.specimens.push(specimen);
                read.understood.push(how);
            }
        }
        if ids.is_empty() {
            read.mistakes.push(InputError::new(
                file,
                "",
                "",
                "lists no specimen",
                "Write one line per specimen under the header.",
            ));
        }
        read
    }

    /// Removes the specimens of all tests except `test`; keeps all specimens if `test` is `None`. `file` is the path of
    /// the table.
    pub fn of_test(mut self, test: Option<&str>, file: &Path) -> Self {
        let Some(test) = test else { return self };
        let mut tests: Vec<&str> =
            self.table.specimens.iter().filter_map(|specimen| specimen.test.as_deref()).collect();
        tests.sort_unstable();
        tests.dedup();
        if !tests.contains(&test) && !self.table.specimens.is_empty() {
            let help = match tests.is_empty() {
                true => "Add a column test with the name of the test of each specimen.".to_owned(),
                false => format!("The column test has: {}.", tests.join(", ")),
            };
            let problem = "no specimen belongs to this test";
            let value = format!("{test:?}");
            self.mistakes.push(InputError::new(file, "column test", value, problem, help));
        }
        let specimens = self.table.specimens.into_iter().zip(self.understood);
        let of_test = specimens.filter(|(specimen, _)| specimen.test.as_deref() == Some(test));
        (self.table.specimens, self.understood) = of_test.unzip();
        self
    }

    /// Reads the specimen of a row and its curve. Also returns a description of the format of the curve. Mistakes are
    /// added to `mistakes`. `None` if the id is not valid or the curve cannot be read.
    fn row(
        &mut self,
        file: &Path,
        row: TableRow<'_>,
        ids: &[String],
        options: &ReadOptions,
    ) -> Option<(Specimen, Option<String>)> {
        let id = row.text("id").to_owned();
        if id.is_empty() || id.contains(['/', '\\']) || id.starts_with('.') {
            let help =
                "The id is the name of the file curves/<id>.csv: use letters, digits, - and _.";
            self.mistakes.push(row.error("id", "is not a plain name", help));
            return None;
        }
        if ids.contains(&id) {
            self.mistakes.push(row.error("id", "occurs twice", "Give each specimen its own id."));
            return None;
        }
        let mut noted = |value: Result<f64, InputError>| match value {
            Ok(value) => value,
            Err(mistake) => {
                self.mistakes.push(mistake);
                f64::NAN
            }
        };
        let height_mm = noted(row.positive("height_mm"));
        let radius_mm = noted(row.positive("radius_mm"));
        let is_given = |column: &str| !row.text(column).is_empty();
        let slope_fraction = is_given("slope_fraction").then(|| noted(slope_fraction(row)));
        let stated = is_given("rate_mm_per_s").then(|| noted(row.positive("rate_mm_per_s")));
        let image = is_given("image").then(|| PathBuf::from(row.text("image")));
        if let Some(image) = image.as_ref().filter(|i| !file.with_file_name(i).exists()) {
            let problem = format!("there is no {}", file.with_file_name(image).display());
            let help = "Name a TIFF file or a folder of slices by its path from the table's folder, \
                        or leave the cell empty.";
            self.mistakes.push(row.error("image", &problem, help));
        }
        let curve = self.curve(file, &id, options, SpecimenSize { height_mm, radius_mm });
        let (curve, rate, how) = match curve {
            Ok(read) => read,
            Err(mistake) => {
                self.mistakes.push(mistake);
                return None;
            }
        };
        let specimen = Specimen {
            id,
            height_mm,
            radius_mm,
            group: row.text("group").to_owned(),
            slope_fraction,
            image,
            test: is_given("test").then(|| row.text("test").to_owned()),
            rate_mm_per_s: rate.or(stated),
            curve,
        };
        Some((specimen, how))
    }

    /// Reads the curve of a specimen. Also returns the speed of the platen in mm/s if the curve has a time, and a
    /// description of the format.
    fn curve(
        &self,
        table: &Path,
        id: &str,
        options: &ReadOptions,
        size: SpecimenSize,
    ) -> Result<(TestCurve, Option<f64>, Option<String>), InputError> {
        let path = recorded_file(table, id)?;
        let (curve, how) = TestCurve::read_as(&path, options, size)?;
        let earlier = self.table.specimens.iter();
        let mut same = earlier.filter_map(|e| Some((e, SameTest::of(&e.curve, &curve)?)));
        if let Some((Specimen { id: same, curve: other, .. }, how)) = same.next() {
            let problem = match how {
                SameTest::Readings if *other == curve => format!("is equal to the curve of {same}"),
                SameTest::Readings => format!("has the readings of {same}"),
                SameTest::Rounded => format!(
                    "has the readings of {same}, with other digits or a constant shift of the displacement"
                ),
            };
            let help = "The same test would count twice: replace the wrong file, or remove one of the two \
                        lines from the table.";
            return Err(InputError::new(&path, "specimen", id, problem, help));
        }
        let is_timed = !curve.time_s.is_empty();
        let rate = is_timed.then(|| mean_rate(&path, &curve)).transpose()?;
        Ok((curve, rate, how))
    }
}

impl SpecimenTable {
    /// Reads a table and, from `curves/` beside it, the curve of each specimen.
    ///
    /// # Errors
    /// If a file cannot be read or has a mistake. The error names file, line, column, value and help.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        Ok(Self::read_as(file, &ReadOptions::default())?.0)
    }

    /// Reads a table whose curves may be exports of a testing machine. Also returns, for each specimen, a description
    /// of the format of the curve; `None` for a plain file with the columns `displacement_mm,force_N`.
    ///
    /// # Errors
    /// The errors of [`SpecimenTable::read`], and an error if two specimens have the same curve.
    pub fn read_as(
        file: &Path,
        options: &ReadOptions,
    ) -> Result<(Self, Vec<Option<String>>), InputError> {
        let SpecimenFiles { table, understood, mistakes, .. } = SpecimenFiles::read(file, options);
        mistakes.into_iter().next().map_or(Ok((table, understood)), Err)
    }
}

impl TestCurve {
    /// Reads a file with the columns `displacement_mm,force_N` and optionally `time_s`.
    ///
    /// # Errors
    /// If a column is missing, a value is not a finite number, there are fewer than five points, or no force is
    /// positive. The error names file, line, column, value and help.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let table = CsvTable::read(file, &["displacement_mm", "force_N"])?;
        let mut curve = Self::default();
        let is_timed = table.has_column("time_s");
        for row in table.rows() {
            curve.displacement_mm.push(row.number("displacement_mm")?);
            curve.force_n.push(row.number("force_N")?);
            if is_timed {
                curve.time_s.push(row.number("time_s")?);
            }
        }
        curve.checked(file)
    }

    /// Reads a plain file or an export of a testing machine. Also returns a description of the format of an export.
    fn read_as(
        file: &Path,
        options: &ReadOptions,
        size: SpecimenSize,
    ) -> Result<(Self, Option<String>), InputError> {
        let is_plain = *options == ReadOptions::default() && has_plain_header(file);
        if is_plain || !file.exists() {
            return Ok((Self::read(file)?, None));
        }
        let Record { displacement_mm, force_n, time_s, understood } =
            Record::read(file, options, size)?;
        let time_s = time_s.unwrap_or_default();
        let curve = Self { time_s, ..Self::new(displacement_mm, force_n) }.checked(file)?;
        Ok((curve, Some(understood)))
    }
}

fn slope_fraction(row: TableRow<'_>) -> Result<f64, InputError> {
    let fraction = row.number("slope_fraction")?;
    if (0.1..=0.9).contains(&fraction) {
        return Ok(fraction);
    }
    Err(row.error(
        "slope_fraction",
        "must lie between 0.1 and 0.9",
        "slope_fraction is a fraction of the displacement at peak; the paper uses 0.3 or 0.55.",
    ))
}

/// Finds the file with the curve of a specimen in the folder `curves` beside the table.
///
/// # Errors
/// If several files have the name of the specimen.
pub fn recorded_file(table: &Path, id: &str) -> Result<PathBuf, InputError> {
    let plain = curve_file(table, id);
    let possible = ENDINGS.iter().map(|ending| plain.with_file_name(format!("{id}.{ending}")));
    let existing: Vec<PathBuf> = possible.filter(|path| path.exists()).collect();
    match &existing[..] {
        [] => Ok(plain),
        [only] => Ok(only.clone()),
        [first, second, ..] => {
            let problem = format!(
                "is one of two curves of the specimen; the other one is {}",
                second.display()
            );
            Err(InputError::new(first, "", "", problem, "Keep one curve for each specimen."))
        }
    }
}

/// Whether the first line that is neither blank nor a comment contains the names `displacement_mm` and `force_N`,
/// separated by commas, and no column of times with another name than `time_s`.
fn has_plain_header(file: &Path) -> bool {
    let Ok(bytes) = fem_file::read_regular(file) else { return false };
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
    let lines = bytes.split(|byte| matches!(byte, b'\n' | b'\r'));
    let is_header = |line: &&[u8]| !line.trim_ascii().is_empty() && line.first() != Some(&b'#');
    let header = lines.into_iter().find(is_header).unwrap_or_default();
    let has =
        |name: &[u8]| header.split(|byte| *byte == b',').any(|cell| cell.trim_ascii() == name);
    let is_other_time = |cell: &[u8]| {
        let name = String::from_utf8_lossy(cell);
        is_time_column(name.trim().trim_matches('"'))
    };
    let has_plain_times =
        || has(b"time_s") || !header.split(|byte| *byte == b',').any(is_other_time);
    has(b"displacement_mm") && has(b"force_N") && has_plain_times()
}

/// Mean speed of the platen in mm/s from the first reading to the largest force.
fn mean_rate(file: &Path, curve: &TestCurve) -> Result<f64, InputError> {
    let time_s = &curve.time_s;
    let force = |i: &usize| curve.force_n[*i];
    let top = (0..time_s.len()).max_by(|a, b| force(a).total_cmp(&force(b))).unwrap_or(0);
    let passed_s = time_s[top] - time_s[0];
    let rate = (curve.displacement_mm[top] - curve.displacement_mm[0]) / passed_s;
    if rate.is_finite() && rate > 0.0 {
        return Ok(rate);
    }
    let problem = format!("passes {passed_s} s from the first reading to the largest force");
    let help = "Correct the column of times, or remove it: the rate of the test is computed from this column.";
    Err(InputError::new(file, "column time", "", problem, help))
}

#[cfg(test)]
mod tests;
