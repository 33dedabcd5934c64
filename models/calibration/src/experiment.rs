//! Experimental data: a table of specimens and one curve per specimen.
//!
//! `specimens.csv` has the columns `id,height_mm,radius_mm,group` and these optional columns, in which a cell may be
//! empty:
//! - `slope_fraction`: displacement at which the slope of this curve is taken, as a fraction of the displacement at
//!   peak (default: the value of the case);
//! - `image`: a scan of the specimen, a TIFF file or a folder of slices; the path is relative to the table's folder;
//! - `rate_mm_per_s`: speed of the platen, used if the curve has no column of times;
//! - `test`: name of the test, for a table with the specimens of several tests.
//!
//! `curves/<id>.csv` beside the table has the columns `displacement_mm,force_N`, compression positive, and optionally
//! `time_s`, which a test with a load program requires. The curve may also be the export of a testing machine (`.csv`, `.txt`, `.tsv`, `.dat`, `.asc`, `.xlsx`):
//! see `ReadOptions`.
//!
//! Lines that start with `#` are comments. Columns may be in any order; other columns are ignored.

use std::io;
use std::path::{Path, PathBuf};

use crate::branch::{Branch, Controlled, ControlledForce, branches, first_loading};
use crate::error::InputError;
use crate::table::to_csv;

/// A force–displacement record, compression positive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TestCurve {
    /// Displacement of the platen in mm.
    pub displacement_mm: Vec<f64>,
    /// Force on the platen in N at each displacement.
    pub force_n: Vec<f64>,
    /// Time in s of each displacement; empty if the times are unknown.
    pub time_s: Vec<f64>,
    /// Branches of the load program; empty if the whole curve is one loading.
    pub branches: Vec<Branch>,
}

impl TestCurve {
    /// Creates a curve without times.
    pub fn new(displacement_mm: Vec<f64>, force_n: Vec<f64>) -> Self {
        Self { displacement_mm, force_n, ..Self::default() }
    }

    /// Finds the branches of the curve from its times. Displacements that differ by at most `tolerance_mm` count as
    /// equal. A curve without hold and unloading has no branches.
    pub fn with_branches(self, tolerance_mm: f64) -> Self {
        self.divided(tolerance_mm, None)
    }

    /// Finds the branches of the curve as [`with_branches`](Self::with_branches) does, for a machine that controls the
    /// force in some of the branches: `force_is_controlled` states for each reading whether the machine controlled the
    /// force since the reading before. Forces that differ by at most `tolerance_n` count as equal: the curve has no noise.
    pub fn with_force_branches(
        self,
        tolerance_mm: f64,
        tolerance_n: f64,
        force_is_controlled: &[bool],
    ) -> Self {
        self.divided(tolerance_mm, Some((tolerance_n, force_is_controlled)))
    }

    fn divided(mut self, tolerance_mm: f64, by_force: Option<(f64, &[bool])>) -> Self {
        let displacement = Controlled { values: &self.displacement_mm, tolerance: tolerance_mm };
        let force = by_force.map(|(tolerance, is_controlled)| ControlledForce {
            force: Controlled { values: &self.force_n, tolerance },
            is_controlled,
        });
        let found = branches(&self.time_s, displacement, force);
        self.branches = if found.len() > 1 { found } else { Vec::new() };
        self
    }

    /// Indices of the readings of the first loading: the readings of loading branches beyond the largest displacement of
    /// all earlier branches. `None` if the whole curve is one loading.
    pub fn first_loading(&self) -> Option<Vec<usize>> {
        let has_branches = !self.branches.is_empty();
        has_branches.then(|| first_loading(&self.branches, &self.displacement_mm))
    }

    /// The curve with only the readings of the given indices, without branches.
    pub fn picked(&self, indices: &[usize]) -> Self {
        let pick =
            |values: &[f64]| indices.iter().filter_map(|&i| values.get(i).copied()).collect();
        Self {
            displacement_mm: pick(&self.displacement_mm),
            force_n: pick(&self.force_n),
            time_s: pick(&self.time_s),
            branches: Vec::new(),
        }
    }

    /// The curve with every displacement multiplied by `factor`.
    ///
    /// A specimen of height H and a mesh of height H′ are compared at equal nominal strain: the displacement of the
    /// specimen is multiplied by H′/H.
    pub fn scale_displacement(&self, factor: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm.iter().map(|u| factor * u).collect(),
            ..self.clone()
        }
    }

    /// The curve with every force multiplied by `factor`.
    ///
    /// A specimen with cross-section A and a mesh with cross-section A′ are compared at equal nominal stress: the force
    /// on the specimen is multiplied by A′/A.
    pub fn scale_force(&self, factor: f64) -> Self {
        Self { force_n: self.force_n.iter().map(|force| factor * force).collect(), ..self.clone() }
    }

    /// The curve with `by_mm` added to every displacement.
    pub fn shift_displacement(&self, by_mm: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm.iter().map(|u| u + by_mm).collect(),
            ..self.clone()
        }
    }

    /// Returns an error if the curve has fewer than five points or no positive force.
    pub(crate) fn checked(self, file: &Path) -> Result<Self, InputError> {
        if self.force_n.len() < 5 {
            return Err(InputError::new(
                file,
                "",
                "",
                format!("has {} points", self.force_n.len()),
                "A curve needs at least five points, some of them after the peak.",
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

    /// Content of the CSV file that `TestCurve::read` reads.
    ///
    /// # Errors
    /// None: text in memory can always be written.
    pub fn to_csv(&self) -> io::Result<Vec<u8>> {
        let rows = self.displacement_mm.iter().zip(&self.force_n);
        let rows = rows.map(|(u, f)| [u.to_string(), f.to_string()]);
        if self.time_s.is_empty() {
            return to_csv(["displacement_mm", "force_N"], rows);
        }
        let rows = self.time_s.iter().zip(rows).map(|(t, [u, f])| [t.to_string(), u, f]);
        to_csv(["time_s", "displacement_mm", "force_N"], rows)
    }
}

/// One tested specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct Specimen {
    /// Name of the specimen, and of the file with its curve.
    pub id: String,
    /// Height in mm.
    pub height_mm: f64,
    /// Radius in mm.
    pub radius_mm: f64,
    /// Name of the group of specimens that were made in the same way, for example their pressing temperature `50C`.
    pub group: String,
    /// Displacement at which the initial slope is taken, as a fraction of the displacement at peak. `None`: the value
    /// of the case is used.
    pub slope_fraction: Option<f64>,
    /// Path of a scan of the specimen, relative to the folder of the table.
    pub image: Option<PathBuf>,
    /// Name of the test, for a table with the specimens of several tests.
    pub test: Option<String>,
    /// Speed of the platen in mm/s, from the times of the curve or from the table. `None`: unknown.
    pub rate_mm_per_s: Option<f64>,
    /// Recorded curve.
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
    /// Specimens in the order of the table.
    pub specimens: Vec<Specimen>,
}

impl SpecimenTable {
    /// Returns the files of the table and its curves: paths relative to the table's folder, and contents.
    ///
    /// # Errors
    /// None: text in memory can always be written.
    pub fn to_files(&self) -> io::Result<Vec<(PathBuf, Vec<u8>)>> {
        // optional columns without any value are omitted
        let written = [
            ("slope_fraction", self.specimens.iter().any(|s| s.slope_fraction.is_some())),
            ("image", self.specimens.iter().any(|s| s.image.is_some())),
            ("rate_mm_per_s", self.specimens.iter().any(|s| s.rate_mm_per_s.is_some())),
            ("test", self.specimens.iter().any(|s| s.test.is_some())),
        ];
        let rows = self.specimens.iter().map(|s| {
            let fraction = s.slope_fraction.map(|f| f.to_string()).unwrap_or_default();
            let image = s.image.as_ref().map(|i| i.display().to_string()).unwrap_or_default();
            let rate = s.rate_mm_per_s.map(|rate| rate.to_string()).unwrap_or_default();
            let Specimen { id, height_mm, radius_mm, group, .. } = s;
            let always = [id.clone(), height_mm.to_string(), radius_mm.to_string(), group.clone()];
            let test = s.test.clone().unwrap_or_default();
            let optional =
                [fraction, image, rate, test].into_iter().zip(written).filter(|(_, (_, has))| *has);
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

    /// Names of the groups in alphabetical order, with their numbers of specimens.
    pub fn groups(&self) -> Vec<(&str, usize)> {
        let mut names: Vec<&str> = self.specimens.iter().map(|s| s.group.as_str()).collect();
        names.sort_unstable();
        let groups = names.chunk_by(|a, b| a == b);
        groups.map(|group| (group[0], group.len())).collect()
    }

    /// Returns the table if it has only one group.
    ///
    /// # Errors
    /// If the table has several groups; the error names `file`.
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

    /// Returns the table with only the specimens of `group`.
    ///
    /// # Errors
    /// If no specimen belongs to the group; the error names `file`.
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

/// Path of the CSV file with the curve of a specimen: `curves/<id>.csv` beside the table.
pub fn curve_file(table: &Path, id: &str) -> PathBuf {
    table.with_file_name("curves").join(format!("{id}.csv"))
}
