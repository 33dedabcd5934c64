//! What is measured: a table of specimens and one curve a specimen.
//!
//! `specimens.csv` has the columns `id,height_mm,radius_mm,group` and, if a curve is to have its
//! slope taken elsewhere than the others, `slope_fraction` (empty: the case's value).
//! A column `image` names a scan of each specimen, a TIFF file or a folder of slices, by its path from the
//! table's folder (empty: none).
//! `curves/<id>.csv` beside it has `displacement_mm,force_N`, compression positive, and `time_s` if that was recorded;
//! or it is the export of a testing machine (`.csv`, `.txt`, `.tsv`, `.dat`, `.asc`, `.xlsx`): see [`ReadOptions`].
//! A column `rate_mm_per_s` of the table is the speed of the platen where its curve has no time.
//! Lines that start with `#` are comments; columns may come in any order; further ones are ignored.

use std::io;
use std::path::{Path, PathBuf};

use crate::error::InputError;
use crate::record::{ReadOptions, Record, SpecimenSize};
use crate::table::{CsvTable, to_csv};

/// Endings of files with curves, in the order in which they are looked for.
const ENDINGS: [&str; 6] = ["csv", "txt", "tsv", "dat", "asc", "xlsx"];

/// A force–displacement record, compression positive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TestCurve {
    /// Displacement of the platen in mm.
    pub displacement_mm: Vec<f64>,
    /// Force on the platen in N, one for each displacement.
    pub force_n: Vec<f64>,
}

impl TestCurve {
    /// The curve with every displacement multiplied by `factor`.
    ///
    /// A specimen of height H compares with a mesh of height H′ at equal nominal strain,
    /// that is with its displacement times H′/H.
    pub fn scale_displacement(&self, factor: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm.iter().map(|u| factor * u).collect(),
            force_n: self.force_n.clone(),
        }
    }

    /// The curve with `by_mm` added to every displacement.
    pub fn shift_displacement(&self, by_mm: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm.iter().map(|u| u + by_mm).collect(),
            force_n: self.force_n.clone(),
        }
    }

    /// Reads `displacement_mm,force_N`.
    ///
    /// # Errors
    /// Names file, line, column, value and help: a missing column, a value that is no finite
    /// number, fewer than five points, no positive force.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        Ok(PlainRecord::read(file)?.curve)
    }

    /// Refuses a curve that quantities of interest cannot be taken from.
    fn checked(self, file: &Path) -> Result<Self, InputError> {
        if self.force_n.len() < 5 {
            return Err(InputError::new(
                file,
                "",
                "",
                format!("has {} points", self.force_n.len()),
                "A curve needs at least five, and some past the peak.",
            ));
        }
        if self.force_n.iter().all(|&force| force <= 0.0) {
            return Err(InputError::new(
                file,
                "column force_N",
                "",
                "has no positive value",
                "Compression is positive: change the sign of force and displacement, or write \
                 compression = \"negative\" under [experiments.read].",
            ));
        }
        Ok(self)
    }

    /// The content of the file that [`TestCurve::read`] reads.
    ///
    /// # Errors
    /// None: text in memory can always be written.
    pub fn to_csv(&self) -> io::Result<Vec<u8>> {
        let rows = self.displacement_mm.iter().zip(&self.force_n);
        to_csv(["displacement_mm", "force_N"], rows.map(|(u, f)| [u.to_string(), f.to_string()]))
    }
}

/// One tested specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct Specimen {
    /// Name, also of its curve's file.
    pub id: String,
    /// Height in mm.
    pub height_mm: f64,
    /// Radius in mm.
    pub radius_mm: f64,
    /// What specimens of one make have in common, for example a pressing temperature `50C`.
    pub group: String,
    /// Where the initial slope is taken, as a fraction of the displacement at peak, if not where the case says.
    pub slope_fraction: Option<f64>,
    /// A scan of it, from the folder of the table.
    pub image: Option<PathBuf>,
    /// Speed of the platen in mm/s, from the time of the curve or the table's column; absent: unknown.
    pub rate_mm_per_s: Option<f64>,
    /// What the test recorded.
    pub curve: TestCurve,
}

/// Tested specimens with their curves.
///
/// # Example
/// ```no_run
/// let table = breccia_calibration::SpecimenTable::read("specimens.csv".as_ref())?;
/// println!("{} specimens", table.specimens.len());
/// # Ok::<(), breccia_calibration::InputError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpecimenTable {
    /// In the order of the table.
    pub specimens: Vec<Specimen>,
}

impl SpecimenTable {
    /// Reads a table and, from `curves/` beside it, the curve of each specimen.
    ///
    /// # Errors
    /// Names file, line, column, value and help.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        Ok(Self::read_as(file, &ReadOptions::default())?.0)
    }

    /// Reads a table whose curves are exports of a testing machine, and returns for each specimen how its curve was
    /// read; nothing where that is `displacement_mm,force_N` as it stands.
    ///
    /// # Errors
    /// As [`SpecimenTable::read`]; two specimens with one curve.
    pub fn read_as(
        file: &Path,
        options: &ReadOptions,
    ) -> Result<(Self, Vec<Option<String>>), InputError> {
        let table = CsvTable::read(file, &["id", "height_mm", "radius_mm", "group"])?;
        let mut specimens: Vec<Specimen> = Vec::new();
        let mut understood = Vec::new();
        for row in table.rows() {
            let id = row.text("id").to_owned();
            if id.is_empty() || id.contains(['/', '\\']) || id.starts_with('.') {
                return Err(row.error(
                    "id",
                    "is no plain name",
                    "It names the file curves/<id>.csv: use letters, digits, - and _.",
                ));
            }
            if specimens.iter().any(|other| other.id == id) {
                return Err(row.error("id", "occurs twice", "Give each specimen its own id."));
            }
            let (height_mm, radius_mm) = (row.positive("height_mm")?, row.positive("radius_mm")?);
            let slope_fraction = match row.text("slope_fraction") {
                "" => None,
                _ => Some(row.number("slope_fraction")?),
            };
            if slope_fraction.is_some_and(|f| !(0.1..=0.9).contains(&f)) {
                return Err(row.error(
                    "slope_fraction",
                    "must lie between 0.1 and 0.9",
                    "It is a fraction of the displacement at peak; the paper takes 0.3 or 0.55.",
                ));
            }
            let image = Some(row.text("image")).filter(|name| !name.is_empty()).map(PathBuf::from);
            if let Some(image) = image.as_ref().filter(|i| !file.with_file_name(i).exists()) {
                let problem = format!("there is no {}", file.with_file_name(image).display());
                let help = "Name a TIFF file or a folder of slices by its path from the table's folder, \
                            or leave the cell empty.";
                return Err(row.error("image", &problem, help));
            }
            let path = recorded_file(file, &id)?;
            let size = SpecimenSize { height_mm, radius_mm };
            let (recorded, how) = PlainRecord::read_as(&path, options, size)?;
            let PlainRecord { curve, time_s } = recorded;
            if let Some(same) = specimens.iter().find(|other| other.curve == curve) {
                let problem = format!("is the curve of {}, too", same.id);
                let help = "One test would count twice: put the right file in its place, or remove one of the two \
                            lines from the table.";
                return Err(InputError::new(&path, "specimen", id, problem, help));
            }
            let stated = match row.text("rate_mm_per_s") {
                "" => None,
                _ => Some(row.positive("rate_mm_per_s")?),
            };
            let rate_mm_per_s = match &time_s {
                Some(time_s) => Some(mean_rate(&path, &curve, time_s)?),
                None => stated,
            };
            understood.push(how);
            specimens.push(Specimen {
                id,
                height_mm,
                radius_mm,
                group: row.text("group").to_owned(),
                slope_fraction,
                image,
                rate_mm_per_s,
                curve,
            });
        }
        if specimens.is_empty() {
            return Err(InputError::new(
                file,
                "",
                "",
                "lists no specimen",
                "Write one line a specimen under the header.",
            ));
        }
        Ok((Self { specimens }, understood))
    }

    /// The table's files: paths relative to the table's folder, and contents.
    ///
    /// # Errors
    /// None: text in memory can always be written.
    pub fn to_files(&self) -> io::Result<Vec<(PathBuf, Vec<u8>)>> {
        // columns that no specimen fills are left out
        let written = [
            ("slope_fraction", self.specimens.iter().any(|s| s.slope_fraction.is_some())),
            ("image", self.specimens.iter().any(|s| s.image.is_some())),
            ("rate_mm_per_s", self.specimens.iter().any(|s| s.rate_mm_per_s.is_some())),
        ];
        let rows = self.specimens.iter().map(|s| {
            let fraction = s.slope_fraction.map(|f| f.to_string()).unwrap_or_default();
            let image = s.image.as_ref().map(|i| i.display().to_string()).unwrap_or_default();
            let rate = s.rate_mm_per_s.map(|rate| rate.to_string()).unwrap_or_default();
            let Specimen { id, height_mm, radius_mm, group, .. } = s;
            let always = [id.clone(), height_mm.to_string(), radius_mm.to_string(), group.clone()];
            let optional =
                [fraction, image, rate].into_iter().zip(written).filter(|(_, (_, has))| *has);
            always.into_iter().chain(optional.map(|(cell, _)| cell)).collect::<Vec<_>>()
        });
        let optional = written.iter().filter(|(_, has)| *has).map(|(name, _)| *name);
        let header = ["id", "height_mm", "radius_mm", "group"].into_iter().chain(optional);
        let table = PathBuf::from("specimens.csv");
        let mut files = vec![(table.clone(), to_csv(header, rows)?)];
        for specimen in &self.specimens {
            files.push((curve_file(&table, &specimen.id), specimen.curve.to_csv()?));
        }
        Ok(files)
    }

    /// Only the specimens of one group.
    ///
    /// # Errors
    /// When none belongs to it; `file` is named in the error.
    pub fn in_group(mut self, group: &str, file: &Path) -> Result<Self, InputError> {
        let mut groups: Vec<&str> = self.specimens.iter().map(|s| s.group.as_str()).collect();
        groups.sort_unstable();
        groups.dedup();
        if !groups.contains(&group) {
            return Err(InputError::new(
                file,
                "experiments.group",
                format!("{group:?}"),
                "no specimen belongs to this group",
                format!("The table's groups are: {}.", groups.join(", ")),
            ));
        }
        self.specimens.retain(|s| s.group == group);
        Ok(self)
    }
}

fn curve_file(table: &Path, id: &str) -> PathBuf {
    table.with_file_name("curves").join(format!("{id}.csv"))
}

/// The file with the curve of a specimen, in the folder `curves` beside its table.
///
/// # Errors
/// Several files have its name.
pub fn recorded_file(table: &Path, id: &str) -> Result<PathBuf, InputError> {
    let plain = curve_file(table, id);
    let possible = ENDINGS.iter().map(|ending| plain.with_file_name(format!("{id}.{ending}")));
    let found: Vec<PathBuf> = possible.filter(|path| path.exists()).collect();
    match &found[..] {
        [] => Ok(plain),
        [only] => Ok(only.clone()),
        [first, second, ..] => {
            let problem = format!("is there beside {}", second.display());
            Err(InputError::new(first, "", "", problem, "Keep one curve for each specimen."))
        }
    }
}

/// A curve with the time of its readings.
struct PlainRecord {
    curve: TestCurve,
    time_s: Option<Vec<f64>>,
}

impl PlainRecord {
    /// Reads `displacement_mm,force_N` and, if it is there, `time_s`.
    fn read(file: &Path) -> Result<Self, InputError> {
        let table = CsvTable::read(file, &["displacement_mm", "force_N"])?;
        let mut curve = TestCurve::default();
        let mut time_s = table.has_column("time_s").then(Vec::new);
        for row in table.rows() {
            curve.displacement_mm.push(row.number("displacement_mm")?);
            curve.force_n.push(row.number("force_N")?);
            if let Some(time_s) = &mut time_s {
                time_s.push(row.number("time_s")?);
            }
        }
        Ok(Self { curve: curve.checked(file)?, time_s })
    }

    /// Reads a plain record or an export, and describes how that was read.
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
        let curve = TestCurve { displacement_mm, force_n }.checked(file)?;
        Ok((Self { curve, time_s }, Some(understood)))
    }
}

/// Whether the first line that is no comment names `displacement_mm` and `force_N`, separated by commas.
fn has_plain_header(file: &Path) -> bool {
    let Ok(bytes) = fem::read_regular(file) else { return false };
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
    let lines = bytes.split(|byte| matches!(byte, b'\n' | b'\r'));
    let is_header = |line: &&[u8]| !line.trim_ascii().is_empty() && line.first() != Some(&b'#');
    let header = lines.into_iter().find(is_header).unwrap_or_default();
    let has =
        |name: &[u8]| header.split(|byte| *byte == b',').any(|cell| cell.trim_ascii() == name);
    has(b"displacement_mm") && has(b"force_N")
}

/// Mean speed of the platen in mm/s from the first reading to the largest force.
fn mean_rate(file: &Path, curve: &TestCurve, time_s: &[f64]) -> Result<f64, InputError> {
    let force = |i: &usize| curve.force_n[*i];
    let top = (0..time_s.len()).max_by(|a, b| force(a).total_cmp(&force(b))).unwrap_or(0);
    let passed_s = time_s[top] - time_s[0];
    let rate = (curve.displacement_mm[top] - curve.displacement_mm[0]) / passed_s;
    if rate.is_finite() && rate > 0.0 {
        return Ok(rate);
    }
    let problem = format!("passes {passed_s} s from the first reading to the largest force");
    let help = "Correct the column, or remove it: the rate of the test is taken from it.";
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
        };
        let specimen = |id: &str, slope_fraction| Specimen {
            id: id.into(),
            height_mm: 4.95,
            radius_mm: 2.5,
            group: "50C".into(),
            slope_fraction,
            image: None,
            rate_mm_per_s: slope_fraction,
            // no two specimens have one curve
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
                &["height_mm", "missing", "Is the column \"hieght\" meant?"],
            ),
            (
                good.replace("group\n", "group,radius_mm\n").replace("50C\n", "50C,2.6\n"),
                CURVE.into(),
                &["column = radius_mm", "occurs twice"],
            ),
            (good.replace(',', ";"), CURVE.into(), &["comma"]),
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

    #[test]
    fn one_curve_for_two_specimens_is_refused() {
        let (dir, file) =
            written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\nS-2,4.4,2.5,a\n", CURVE);
        std::fs::copy(dir.path().join("curves/S-1.csv"), dir.path().join("curves/S-2.csv"))
            .unwrap();
        let error = SpecimenTable::read(&file).unwrap_err().to_string();
        assert!(error.contains("S-2.csv") && error.contains("is the curve of S-1, too"), "{error}");
    }

    /// 0.12 mm in 240 s; the export says how it was read, and two files for one specimen are refused.
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
}
