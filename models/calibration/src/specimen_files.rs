//! Reads the table of specimens and the curve of each specimen, and collects all mistakes.

use std::path::{Path, PathBuf};

use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable, TestCurve, curve_file};
use crate::record::{ReadOptions, Record, SpecimenSize, is_time_column};
use crate::same_test::is_same_test;
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
        let is_same = |other: &&Specimen| is_same_test(&other.curve, &curve);
        if let Some(same) = self.table.specimens.iter().find(is_same) {
            let problem = match same.curve == curve {
                true => format!("is equal to the curve of {}", same.id),
                false => format!("is equal to the curve of {} up to rounding", same.id),
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
mod tests {
    use super::*;

    const CURVE: &str = "displacement_mm,force_N\n0,0\n0.05,80\n0.1,140\n0.12,147\n0.15,129\n";

    fn written(table: &str, curve: &str) -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("specimens.csv");
        std::fs::create_dir(dir.path().join("curves")).unwrap();
        std::fs::write(&file, table).unwrap();
        std::fs::write(dir.path().join("curves/S-1.csv"), curve).unwrap();
        (dir, file)
    }

    #[test]
    fn what_is_written_is_read_again() {
        let curve = TestCurve {
            displacement_mm: vec![0.0, 0.1, 1.0 / 3.0, 0.4, 0.5],
            force_n: vec![0.0, 1e-17, 147.103_2, 3.0, 2.0],
            ..TestCurve::default()
        };
        let specimen = |id: &str, slope_fraction| Specimen {
            id: id.into(),
            height_mm: 4.95,
            radius_mm: 2.5,
            group: "50C".into(),
            slope_fraction,
            image: None,
            test: slope_fraction.map(|_| "slow".to_owned()),
            rate_mm_per_s: slope_fraction,
            // the curves must differ, because two specimens with the same curve are an error
            curve: curve.scale_displacement(if id == "S-1" { 1.0 } else { 1.1 }),
        };
        for fraction in [None, Some(0.55)] {
            let mut table =
                SpecimenTable { specimens: vec![specimen("S-1", fraction), specimen("S-2", None)] };
            let dir = tempfile::tempdir().unwrap();
            if fraction.is_some() {
                std::fs::write(dir.path().join("scan.tif"), "").unwrap();
                table.specimens[1].image = Some("scan.tif".into());
            }
            std::fs::create_dir(dir.path().join("curves")).unwrap();
            for (path, text) in table.to_files().unwrap() {
                std::fs::write(dir.path().join(path), text).unwrap();
            }
            let again = SpecimenTable::read(&dir.path().join("specimens.csv")).unwrap();
            assert_eq!(again, table);
        }
    }

    #[test]
    fn columns_in_any_order_with_comments_blanks_and_a_byte_order_mark() {
        let (_dir, file) = written(
            "\u{feff}# pressed in May\ngroup, id ,radius_mm,height_mm,note\n50C,S-1,2.5,4.4,fine\n",
            CURVE,
        );
        let specimen = SpecimenTable::read(&file).unwrap().specimens.remove(0);
        assert_eq!((specimen.height_mm, specimen.radius_mm), (4.4, 2.5));
        assert_eq!(specimen.curve.force_n[3], 147.0);
    }

    /// The table is in the format of a German spreadsheet.
    #[test]
    fn a_table_with_semicolons_and_decimal_commas_is_read() {
        let text = "id;height_mm;radius_mm;group\r\nS-1;4,4;2,5;gr\u{fc}n\r\n";
        let (_dir, file) = written("", CURVE);
        std::fs::write(&file, text.chars().map(|c| c as u32 as u8).collect::<Vec<u8>>()).unwrap();
        let read = SpecimenFiles::read(&file, &ReadOptions::default());
        assert_eq!(read.mistakes, []);
        let understood = read.table_understood.unwrap();
        assert_eq!(understood, "separator ;, decimal comma, Latin-1");
        let specimen = &read.table.specimens[0];
        assert_eq!((specimen.height_mm, specimen.radius_mm), (4.4, 2.5));
        assert_eq!(specimen.group, "grün");
    }

    #[test]
    fn every_mistake_names_place_value_and_help() {
        let header = "id,height_mm,radius_mm,group\n";
        let line = "S-1,4.4,2.5,50C\n";
        let good = format!("{header}{line}");
        let cases: Vec<(String, String, &[&str])> = vec![
            (
                format!("{header}S-1,four,2.5,50C\n"),
                CURVE.into(),
                &["specimens.csv", "line 2, column height_mm = four", "number"],
            ),
            (
                format!("{header}S-1,-4.4,2.5,50C\n"),
                CURVE.into(),
                &["height_mm = -4.4", "positive"],
            ),
            (format!("{good}{line}"), CURVE.into(), &["line 3, column id = S-1", "twice"]),
            (format!("{header}../S-1,4.4,2.5,50C\n"), CURVE.into(), &["column id", "plain name"]),
            (
                "id,hight_mm,radius_mm,group\nS-1,4.4,2.5,50C\n".into(),
                CURVE.into(),
                &["height_mm", "missing", "hight_mm"],
            ),
            (
                "id,hieght,radius_mm,group\nS-1,4.4,2.5,50C\n".into(),
                CURVE.into(),
                &["height_mm", "missing", "Did you mean the column \"hieght\"?"],
            ),
            (
                good.replace("group\n", "group,radius_mm\n").replace("50C\n", "50C,2.6\n"),
                CURVE.into(),
                &["column = radius_mm", "occurs twice"],
            ),
            (good.replace(',', "|"), CURVE.into(), &["id is missing"]),
            (format!("{header}S-1,4,4,2.5,50C\n"), CURVE.into(), &["line 2", "decimal point"]),
            (header.into(), CURVE.into(), &["no specimen"]),
            (format!("{header}S-9,4.4,2.5,50C\n"), CURVE.into(), &["S-9.csv", "cannot be read"]),
            (
                good.clone(),
                "displacement_mm,force_N\n0,0\n0.1,nan\n".into(),
                &["S-1.csv", "line 3, column force_N = nan"],
            ),
            (good.clone(), "displacement_mm,force_N\n0,0\n0.1,10\n".into(), &["2 points", "five"]),
            (
                good.clone(),
                CURVE.replace(",1", ",-1").replace(",80", ",-80"),
                &["Compression is positive"],
            ),
            (
                good.replace("group\n", "group,slope_fraction\n").replace("50C\n", "50C,3\n"),
                CURVE.into(),
                &["slope_fraction = 3", "0.1"],
            ),
        ];
        for (table, curve, parts) in cases {
            let (_dir, file) = written(&table, &curve);
            let message = SpecimenTable::read(&file).unwrap_err().to_string();
            for part in parts {
                assert!(message.contains(part), "{part:?} is not in {message:?}");
            }
        }
    }

    /// A plain file whose times have another name or unit is read with its times. A column of times that cannot be read is
    /// an error that names the keys.
    #[test]
    fn every_column_of_times_of_a_plain_file_is_read_or_refused() {
        let table = "id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\n";
        let with = |name: &str, times: [&str; 5]| {
            let cells = [name].into_iter().chain(times);
            let lines = CURVE.lines().zip(cells).map(|(line, cell)| format!("{line},{cell}\n"));
            lines.collect::<String>()
        };
        let seconds = ["0", "110", "220", "264", "330"];
        for (name, times) in [
            ("time_s", seconds),
            ("time (s)", seconds),
            ("t_s", seconds),
            ("Time_s", seconds),
            ("Seconds", seconds),
            ("time_ms", ["0", "110e3", "220e3", "264e3", "330e3"]),
            ("time", ["00:00", "01:50", "03:40", "04:24", "05:30"]),
            ("Zeit", ["10:00:00", "10:01:50.0", "10:03:40", "10:04:24", "10:05:30"]),
        ] {
            let (_dir, file) = written(table, &with(name, times));
            let specimens = SpecimenTable::read(&file).unwrap_or_else(|e| panic!("{name}: {e}"));
            let rate = specimens.specimens[0].rate_mm_per_s.unwrap();
            assert!((rate * 264.0 / 0.12 - 1.0).abs() < 1e-12, "{name}: {rate}");
        }
        for (name, times, parts) in [
            ("time", seconds, ["column time: has no unit", "time_unit = \"s\"", "time = \"\""]),
            ("time (ticks)", seconds, ["unknown unit", "time_unit", "time = \"\""]),
            ("time_min", ["a", "b", "c", "d", "e"], ["time_min = a", "time_unit", "time = \"\""]),
        ] {
            let (_dir, file) = written(table, &with(name, times));
            let message = SpecimenTable::read(&file).unwrap_err().to_string();
            for part in parts {
                assert!(message.contains(part), "{name}: {part:?} is not in {message:?}");
            }
            let options = ReadOptions { time: Some(String::new()), ..ReadOptions::default() };
            let (specimens, _) = SpecimenTable::read_as(&file, &options).unwrap();
            assert_eq!(specimens.specimens[0].rate_mm_per_s, None);
        }
    }

    #[test]
    fn one_curve_for_two_specimens_is_refused() {
        let (dir, file) =
            written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\nS-2,4.4,2.5,a\n", CURVE);
        std::fs::copy(dir.path().join("curves/S-1.csv"), dir.path().join("curves/S-2.csv"))
            .unwrap();
        let error = SpecimenTable::read(&file).unwrap_err().to_string();
        assert!(
            error.contains("S-2.csv") && error.contains("is equal to the curve of S-1"),
            "{error}"
        );
        let in_kn = "displacement_mm,force_kN,time_min\n0,0,0\n0.05,0.08,1\n0.1,0.14,2\n0.12,0.147,3\n0.15,0.129,4\n";
        std::fs::write(dir.path().join("curves/S-2.csv"), in_kn).unwrap();
        let error = SpecimenTable::read(&file).unwrap_err().to_string();
        assert!(error.contains("is equal to the curve of S-1 up to rounding"), "{error}");
    }

    /// The rate is 0.12 mm in 240 s. The format of the export is described. Two curve files for one specimen are an
    /// error.
    #[test]
    fn exports_have_a_rate_and_are_found_by_their_endings() {
        let (dir, file) = written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\n", CURVE);
        let export = "t [s]\tWeg [mm]\tKraft [kN]\n0\t0\t0\n100\t0,05\t0,08\n200\t0,1\t0,14\n240\t0,12\t0,147\n300\t0,15\t0,129\n";
        let options = ReadOptions { time: Some("t".into()), ..ReadOptions::default() };
        std::fs::write(dir.path().join("curves/S-1.txt"), export).unwrap();
        let error = SpecimenTable::read_as(&file, &options).unwrap_err().to_string();
        assert!(error.contains("S-1.csv") && error.contains("S-1.txt"), "{error}");
        std::fs::remove_file(dir.path().join("curves/S-1.csv")).unwrap();
        let (table, understood) = SpecimenTable::read_as(&file, &options).unwrap();
        let rate = table.specimens[0].rate_mm_per_s.unwrap();
        assert!((rate - 0.12 / 240.0).abs() < 1e-12, "{rate}");
        assert_eq!(table.specimens[0].curve.force_n[3], 147.0);
        assert!(understood[0].as_ref().unwrap().contains("load in kN"), "{understood:?}");
        let plain = CURVE
            .replace("force_N", "force_N,time_s")
            .replace('\n', ",0\n")
            .replacen("time_s,0", "time_s", 1);
        std::fs::remove_file(dir.path().join("curves/S-1.txt")).unwrap();
        std::fs::write(dir.path().join("curves/S-1.csv"), plain).unwrap();
        let error = SpecimenTable::read(&file).unwrap_err().to_string();
        assert!(error.contains("column time: passes 0 s"), "{error}");
    }

    #[test]
    fn a_group_is_chosen_or_the_groups_are_named() {
        let (_dir, file) = written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,50C\n", CURVE);
        let table = SpecimenTable::read(&file).unwrap();
        assert_eq!(table.clone().in_group("50C", &file).unwrap(), table);
        let error = table.in_group("90C", &file).unwrap_err();
        assert!(error.help.contains("50C"), "{error}");
    }

    #[test]
    fn all_mistakes_of_a_table_and_its_curves_are_collected() {
        let (dir, file) = written(
            "id,height_mm,radius_mm,group\nS-1,four,-2.5,a\nS-2,4.4,2.5,a\nS-3,4.4,2.5,a\nS-4,4.4,2.5,a\n",
            CURVE,
        );
        std::fs::write(dir.path().join("curves/S-2.csv"), CURVE.replace("80", "eighty")).unwrap();
        std::fs::write(dir.path().join("curves/S-4.csv"), CURVE.replace("80", "81")).unwrap();
        let SpecimenFiles { table, mistakes, .. } =
            SpecimenFiles::read(&file, &ReadOptions::default());
        let ids: Vec<&str> = table.specimens.iter().map(|specimen| specimen.id.as_str()).collect();
        assert_eq!(ids, ["S-4"]);
        let mistakes: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
        assert_eq!(mistakes.len(), 4, "{mistakes:#?}");
        for (mistake, part) in
            mistakes.iter().zip(["height_mm = four", "radius_mm = -2.5", "eighty", "S-3.csv"])
        {
            assert!(mistake.contains(part), "{part}: {mistake}");
        }
    }
}
