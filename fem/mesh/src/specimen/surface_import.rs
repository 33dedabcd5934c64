//! Grains from STL files of other programs: read, checked, smoothed, decimated, separated, with a cylinder around them.
//!
//! # Reference
//! The steps are those of Segmentflow: marching cubes, smoothing, decimation, isostatic shrinking of grains that are too
//! near to one another, a cylinder around the cluster.

use std::path::PathBuf;

use fem_image::Cylinder;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::enclosing::enclosing_cylinder;
use super::overlap::{Overlap, overlaps};
use super::separate::{Separated, least_gap_mm, separated};
use super::surface_files::{NamedSurface, SurfaceImportError, read_surfaces};
use super::{SurfaceError, SurfaceGrains};
use crate::mesh::{Surface, decimated};

/// Grains may overlap by this share of their volume: what smoothing and decimation do to grains that touch.
const MOST_OVERLAP: f64 = 0.01;
/// No grain may lie in another by more than this share of its volume.
const MOST_OVERLAP_OF_ONE: f64 = 0.5;
/// Grains that lose more than this share of their volume by shrinking are warned of.
const MOST_LOSS: f64 = 0.01;
/// A cluster of this many spacings across is one whose unit is right.
const SPACINGS: [f64; 2] = [1.0, 2000.0];

/// The axis of the files that becomes the axis z of the specimen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceAxis {
    /// x; then y becomes x and z becomes y.
    X,
    /// y; then z becomes x and x becomes y.
    Y,
    /// z
    #[default]
    Z,
}

impl SurfaceAxis {
    fn turned(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            Self::X => [y, z, x],
            Self::Y => [z, x, y],
            Self::Z => [x, y, z],
        }
    }
}

/// How grains are taken from STL files.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Meshing, SurfaceImport, stl};
///
/// let dir = std::env::temp_dir().join("fem-doc-surface-import");
/// std::fs::create_dir_all(&dir)?;
/// let grain = CylinderLattice { radius_mm: 1.0, height_mm: 2.0, spacing_mm: 0.5 }.build()?;
/// stl::write(dir.join("grain-1.stl"), "grain", &stl::specimen(&grain))?;
/// let import = SurfaceImport { margin_mm: 0.5, ..SurfaceImport::new(dir.clone()) };
/// let found = import.read([None, None])?;
/// let [radius_mm, height_mm] = found.size_mm();
/// assert!((radius_mm - 1.5).abs() < 1e-6 && (height_mm - 3.0).abs() < 1e-6);
/// let meshed = Meshing::new(0.5).build(radius_mm, height_mm, &found.grains()?)?;
/// assert!((meshed.report.achieved_fraction / found.fraction() - 1.0).abs() < 0.01);
/// # std::fs::remove_dir_all(dir)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceImport {
    /// A folder of STL files, each of which is a grain, or one file, of which each connected part is a grain.
    pub surfaces: PathBuf,
    /// Length of one unit of the files (mm).
    #[serde(default = "one")]
    pub unit_mm: f64,
    /// The axis of the specimen in the files.
    #[serde(default)]
    pub axis: SurfaceAxis,
    /// Passes of Taubin's filter before decimation.
    #[serde(default)]
    pub smoothing_passes: usize,
    /// Divisor of the number of triangles.
    #[serde(default = "one")]
    pub decimation: f64,
    /// Least distance of two grains (mm), to which grains are shrunk; 0 leaves them as they are.
    #[serde(default)]
    pub least_distance_mm: f64,
    /// Distance of the cylinder from the grains (mm).
    #[serde(default)]
    pub margin_mm: f64,
}

fn one() -> f64 {
    1.0
}

impl SurfaceImport {
    /// Surfaces in mm about the axis z, which are used as they are.
    pub fn new(surfaces: PathBuf) -> SurfaceImport {
        SurfaceImport {
            surfaces,
            unit_mm: 1.0,
            axis: SurfaceAxis::Z,
            smoothing_passes: 0,
            decimation: 1.0,
            least_distance_mm: 0.0,
            margin_mm: 0.0,
        }
    }

    /// Checks the settings; no file is read.
    ///
    /// # Errors
    /// [`SurfaceImportError::Field`] for the first that is out of range.
    pub fn validate(&self) -> Result<(), SurfaceImportError> {
        let rules = [
            ("unit_mm", self.unit_mm, 1e-9, 1e6, "a length above 0 (mm): 0.001 for files in µm"),
            (
                "smoothing_passes",
                self.smoothing_passes as f64,
                0.0,
                1000.0,
                "a number from 0 to 1000",
            ),
            ("decimation", self.decimation, 1.0, 1e6, "a factor of at least 1: the paper takes 20"),
            ("least_distance_mm", self.least_distance_mm, 0.0, 1e3, "a length (mm), or 0"),
            ("margin_mm", self.margin_mm, 0.0, 1e3, "a length (mm), or 0"),
        ];
        match rules.into_iter().find(|&(_, value, low, high, _)| !(low..=high).contains(&value)) {
            Some((field, value, _, _, requirement)) => {
                Err(SurfaceImportError::Field { field, value, requirement })
            }
            None => Ok(()),
        }
    }

    /// Reads the files and does all steps. The cylinder has the radius and the height in mm that are given, about the
    /// middle of the least one.
    ///
    /// # Errors
    /// [`SurfaceImportError`] for files that cannot be read, surfaces that are no grains, and grains that overlap.
    pub fn read(&self, size_mm: [Option<f64>; 2]) -> Result<ImportedSurfaces, SurfaceImportError> {
        self.validate()?;
        let place = |p: [f64; 3]| self.axis.turned(p.map(|x| x * self.unit_mm));
        let grains: Vec<NamedSurface> = read_surfaces(&self.surfaces, &place)?;
        let triangles_read = grains.iter().map(|grain| grain.surface.triangles.len()).sum();
        let turned = grains.iter().filter(|grain| grain.is_turned).count();
        let volume_read_mm3 = grains.iter().map(|grain| grain.surface.volume()).sum();
        let worked = |grain: &NamedSurface| match self.smoothing_passes {
            0 => decimated(&grain.surface, self.decimation),
            passes => decimated(&grain.surface.smoothed(passes), self.decimation),
        };
        let surfaces: Vec<Surface> = grains.par_iter().map(worked).collect();
        let names: Vec<String> = grains.into_iter().map(|grain| grain.name).collect();
        let Separated { surfaces, factors } = self.separated(surfaces, &names)?;
        let overlap_mm3 = match self.least_distance_mm > 0.0 {
            true => 0.0,
            false => checked_overlap(&surfaces, &names)?,
        };
        let cylinder = enclosing_cylinder(&surfaces, self.margin_mm);
        let Some(mut cylinder) = cylinder else {
            return Err(SurfaceImportError::NoFile { path: self.surfaces.clone() });
        };
        let middle = 0.5 * (cylinder.bottom_mm + cylinder.top_mm);
        let height = size_mm[1].unwrap_or(cylinder.height_mm());
        cylinder.radius_mm = size_mm[0].unwrap_or(cylinder.radius_mm);
        (cylinder.bottom_mm, cylinder.top_mm) = (middle - 0.5 * height, middle + 0.5 * height);
        let on_axis = |mut surface: Surface| {
            surface.points.iter_mut().for_each(|point| *point = cylinder.to_specimen(*point));
            surface
        };
        let surfaces: Vec<Surface> = surfaces.into_iter().map(on_axis).collect();
        let least_gap_mm = least_gap_mm(&surfaces).map(|(gap, _)| gap);
        Ok(ImportedSurfaces {
            names,
            surfaces,
            cylinder,
            triangles_read,
            volume_read_mm3,
            turned,
            factors,
            overlap_mm3,
            least_gap_mm,
        })
    }

    fn separated(
        &self,
        surfaces: Vec<Surface>,
        names: &[String],
    ) -> Result<Separated, SurfaceImportError> {
        if self.least_distance_mm <= 0.0 {
            let factors = vec![1.0; surfaces.len()];
            return Ok(Separated { surfaces, factors });
        }
        separated(surfaces, self.least_distance_mm).map_err(|error| {
            SurfaceImportError::Inseparable {
                first: names[error.first - 1].clone(),
                second: names[error.second - 1].clone(),
                least_mm: error.least_mm,
            }
        })
    }
}

/// The volume by which grains overlap (mm³).
///
/// # Errors
/// More than one per cent of all grains, or more than half of one.
fn checked_overlap(surfaces: &[Surface], names: &[String]) -> Result<f64, SurfaceImportError> {
    let found = overlaps(surfaces);
    let all: f64 = surfaces.iter().map(Surface::volume).sum();
    let overlap_mm3: f64 = found.iter().map(|overlap| overlap.volume_mm3).sum();
    let share = |overlap: &&Overlap| {
        let smaller = overlap.grains.map(|grain| surfaces[grain].volume());
        overlap.volume_mm3 / smaller[0].min(smaller[1])
    };
    let Some(worst) = found.iter().max_by(|a, b| share(a).total_cmp(&share(b))) else {
        return Ok(0.0);
    };
    if overlap_mm3 <= MOST_OVERLAP * all && share(&worst) <= MOST_OVERLAP_OF_ONE {
        return Ok(overlap_mm3);
    }
    let [first, second] = worst.grains.map(|grain| names[grain].clone());
    Err(SurfaceImportError::Overlap {
        pairs: found.len(),
        share: overlap_mm3 / all,
        first,
        second,
        share_of_smaller: share(&worst),
    })
}

/// Grains of STL files in a cylinder that stands on z = 0 with its axis on z.
#[derive(Clone, Debug)]
pub struct ImportedSurfaces {
    /// The file of each grain, or the file and the part.
    pub names: Vec<String>,
    /// The grains (mm), in the coordinates of the specimen.
    pub surfaces: Vec<Surface>,
    /// The specimen in the coordinates of the files (mm), after the axis has been turned.
    pub cylinder: Cylinder,
    /// Number of triangles in the files.
    pub triangles_read: usize,
    /// Volume of the grains as they were read (mm³).
    pub volume_read_mm3: f64,
    /// Number of surfaces that showed inward and were turned.
    pub turned: usize,
    /// The factor by which each grain was shrunk.
    pub factors: Vec<f64>,
    /// Volume that belongs to two grains (mm³), by samples.
    pub overlap_mm3: f64,
    /// Least distance of two grains (mm), 0 where two intersect; nothing for one grain.
    pub least_gap_mm: Option<f64>,
}

impl ImportedSurfaces {
    /// Radius and height of the specimen (mm).
    pub fn size_mm(&self) -> [f64; 2] {
        [self.cylinder.radius_mm, self.cylinder.height_mm()]
    }

    /// Volume of all grains (mm³), also of what lies outside the cylinder.
    pub fn volume_mm3(&self) -> f64 {
        self.surfaces.iter().map(Surface::volume).sum()
    }

    /// Volume of all grains over that of the cylinder.
    pub fn fraction(&self) -> f64 {
        self.volume_mm3() / self.cylinder.volume_mm3()
    }

    /// The grains for a mesher.
    ///
    /// # Errors
    /// A surface that is none of a grain; those that were read have been checked.
    pub fn grains(&self) -> Result<SurfaceGrains, SurfaceError> {
        let [radius_mm, height_mm] = self.size_mm();
        SurfaceGrains::new(self.surfaces.clone(), radius_mm, height_mm)
    }

    /// Compares the size of the specimen with the spacing of its mesh.
    ///
    /// # Errors
    /// [`SurfaceImportError::Unit`] for a specimen of less than one spacing or more than two thousand.
    pub fn check_unit(&self, spacing_mm: f64, unit_mm: f64) -> Result<(), SurfaceImportError> {
        let [radius_mm, height_mm] = self.size_mm();
        let size_mm = f64::max(2.0 * radius_mm, height_mm);
        let fits = |size_mm: f64| {
            let spacings = size_mm / spacing_mm;
            (SPACINGS[0]..=SPACINGS[1]).contains(&spacings)
        };
        if fits(size_mm) {
            return Ok(());
        }
        let factors = [1e-3, 1e3, 1e-6, 1e6];
        let likely_mm = factors.into_iter().find(|factor| fits(factor * size_mm));
        let likely_mm = likely_mm.map(|factor| factor * unit_mm);
        Err(SurfaceImportError::Unit { size_mm, spacing_mm, unit_mm, likely_mm })
    }

    /// What was read and done, in words.
    pub fn in_words(&self) -> String {
        let [radius_mm, height_mm] = self.size_mm();
        let triangles: usize = self.surfaces.iter().map(|surface| surface.triangles.len()).sum();
        let gap = match self.least_gap_mm {
            Some(0.0) => ", grains touch".to_owned(),
            Some(gap) => format!(", least distance {gap:.4} mm"),
            None => String::new(),
        };
        format!(
            "{} grains of {} triangles ({} in the files), {:.4} mm³, {:.1} % of a cylinder of radius {radius_mm:.4} mm and \
             height {height_mm:.4} mm{gap}",
            self.surfaces.len(),
            triangles,
            self.triangles_read,
            self.volume_mm3(),
            100.0 * self.fraction()
        )
    }

    /// What a person should look at.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.turned > 0 {
            warnings.push(format!(
                "{} of {} surfaces showed inward and were turned",
                self.turned,
                self.surfaces.len()
            ));
        }
        if self.overlap_mm3 > 0.0 {
            warnings.push(format!(
                "grains overlap by {:.2} % of their volume, which counts once in the mesh: least_distance_mm shrinks them \
                 apart",
                100.0 * self.overlap_mm3 / self.volume_mm3()
            ));
        }
        let shrunk = self.factors.iter().filter(|&&factor| factor < 1.0).count();
        let loss = 1.0 - self.volume_mm3() / self.volume_read_mm3;
        if shrunk > 0 && loss > MOST_LOSS {
            warnings.push(format!(
                "shrinking {shrunk} of {} grains to the least distance took {:.1} % of their volume: the grain fraction is \
                 too small by as much",
                self.surfaces.len(),
                100.0 * loss
            ));
        }
        warnings
    }
}
