//! What is measured: a table of specimens and one curve a specimen.
//!
//! `specimens.csv` has the columns `id,height_mm,radius_mm,group` and, if a curve is to have its
//! slope taken elsewhere than the others, `slope_fraction` (empty: the case's value).
//! A column `image` names a scan of each specimen, a TIFF file or a folder of slices, by its path from the
//! table's folder (empty: none).
//! `curves/<id>.csv` beside it has `displacement_mm,force_N`, compression positive, and `time_s` if that was recorded;
//! or it is the export of a testing machine (`.csv`, `.txt`, `.tsv`, `.dat`, `.asc`, `.xlsx`): see `ReadOptions`.
//! A column `rate_mm_per_s` of the table is the speed of the platen where its curve has no time.
//! Lines that start with `#` are comments; columns may come in any order; further ones are ignored.

use std::io;
use std::path::{Path, PathBuf};

use crate::error::InputError;
use crate::table::to_csv;

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

    /// The curve with every force multiplied by `factor`.
    ///
    /// A specimen of section A compares with a mesh of section A′ at equal nominal stress, that is with its force
    /// times A′/A.
    pub fn scale_force(&self, factor: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm.clone(),
            force_n: self.force_n.iter().map(|force| factor * force).collect(),
        }
    }

    /// The curve with `by_mm` added to every displacement.
    pub fn shift_displacement(&self, by_mm: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm.iter().map(|u| u + by_mm).collect(),
            force_n: self.force_n.clone(),
        }
    }

    /// Refuses a curve that quantities of interest cannot be taken from.
    pub(crate) fn checked(self, file: &Path) -> Result<Self, InputError> {
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

    /// The content of the file that `TestCurve::read` reads.
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

    /// Names of the groups and their numbers of specimens, in the order of the names.
    pub fn groups(&self) -> Vec<(&str, usize)> {
        let mut names: Vec<&str> = self.specimens.iter().map(|s| s.group.as_str()).collect();
        names.sort_unstable();
        let groups = names.chunk_by(|a, b| a == b);
        groups.map(|group| (group[0], group.len())).collect()
    }

    /// The table as one group.
    ///
    /// # Errors
    /// It has several; `file` is named in the error.
    pub fn of_one_group(self, file: &Path) -> Result<Self, InputError> {
        let groups = self.groups();
        if groups.len() < 2 {
            return Ok(self);
        }
        let listed = |(name, count): &(&str, usize)| format!("{name:?} ({count} specimens)");
        let problem = format!(
            "is missing, and the table has several groups: {}",
            groups.iter().map(listed).collect::<Vec<_>>().join(", ")
        );
        let help = format!(
            "Write group = {:?} under [experiments]; to calibrate all against one material, give all lines of the \
             table one group.",
            groups[0].0
        );
        Err(InputError::new(file, "experiments.group", "", problem, help))
    }

    /// Only the specimens of one group.
    ///
    /// # Errors
    /// When none belongs to it; `file` is named in the error.
    pub fn in_group(mut self, group: &str, file: &Path) -> Result<Self, InputError> {
        let groups: Vec<&str> = self.groups().into_iter().map(|(name, _)| name).collect();
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

/// The plain file with the curve of a specimen.
pub(crate) fn curve_file(table: &Path, id: &str) -> PathBuf {
    table.with_file_name("curves").join(format!("{id}.csv"))
}
