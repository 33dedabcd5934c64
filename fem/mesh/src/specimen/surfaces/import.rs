//! Import of grains from STL files: reading, checks, smoothing, decimation, separation, and an enclosing cylinder.
//!
//! # Reference The processing steps after marching cubes are the steps of Segmentflow: smoothing, decimation, isotropic
//! shrinking of grains that are too close to each other, and a cylinder around the grains.

use std::path::PathBuf;

use fem_image::Cylinder;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::enclosing::enclosing_cylinder;
use super::files::{NamedSurface, SurfaceImportError, read_surfaces};
use super::overlap::{Overlap, overlaps};
use super::separate::{Separated, least_gap_mm, separated};
use super::surface_grains::{SurfaceError, SurfaceGrains};
use crate::mesh::{Surface, decimated};

/// Largest accepted total overlap, relative to the volume of all grains. Small overlaps must be accepted, because
/// smoothing and decimation cause them between touching grains.
const MOST_OVERLAP: f64 = 0.01;
/// Largest accepted overlap of one pair of grains, relative to the volume of the smaller grain.
const MOST_OVERLAP_OF_ONE: f64 = 0.5;
/// The import warns if shrinking reduces the total volume of the grains by more than this relative amount.
const MOST_LOSS: f64 = 0.01;
/// Plausible range of the specimen's size, in multiples of the spacing; outside this range the unit is probably wrong.
const SPACINGS: [f64; 2] = [1.0, 2000.0];

/// Axis of the files' coordinates that becomes the z axis of the specimen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceAxis {
    /// The x axis becomes z; y becomes x, and z becomes y.
    X,
    /// The y axis becomes z; z becomes x, and x becomes y.
    Y,
    /// The z axis stays the z axis; coordinates keep their order.
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

/// Settings for importing grains from STL files.
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceImport {
    /// Path of a folder or of a file. In a folder, each STL file is a grain; in a single file, each connected part is a
    /// grain.
    pub surfaces: PathBuf,
    /// Length of one unit of the files (mm).
    #[serde(default = "one")]
    #[schemars(range(min = 1e-9, max = 1e6))]
    pub unit_mm: f64,
    /// Axis of the files' coordinates that is the axis of the specimen.
    #[serde(default)]
    pub axis: SurfaceAxis,
    /// Number of passes of Taubin's smoothing filter before decimation.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1000))]
    pub smoothing_passes: usize,
    /// Factor by which decimation reduces the number of triangles.
    #[serde(default = "one")]
    #[schemars(range(min = 1, max = 1e6))]
    pub decimation: f64,
    /// Required distance between grains (mm). Grains that are closer are shrunk; 0 disables shrinking.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e3))]
    pub least_distance_mm: f64,
    /// Margin between the grains and the enclosing cylinder (mm).
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e3))]
    pub margin_mm: f64,
}

fn one() -> f64 {
    1.0
}

impl SurfaceImport {
    /// Creates settings for surfaces in mm with axis z, without any processing.
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
    /// [`SurfaceImportError::Field`] for the first setting out of range.
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
            ("decimation", self.decimation, 1.0, 1e6, "a factor of at least 1 (recommended: 20)"),
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

    /// Reads the files and performs all processing steps. `size_mm` overrides radius and height (mm) of the enclosing
    /// cylinder; the centre of the cylinder does not change.
    ///
    /// # Errors
    /// [`SurfaceImportError`] if a setting is out of range, a file cannot be read, a surface is not a valid grain, or
    /// grains overlap too much or cannot be separated.
    pub fn read(&self, size_mm: [Option<f64>; 2]) -> Result<ImportedSurfaces, SurfaceImportError> {
        self.validate()?;
        let transform = |p: [f64; 3]| self.axis.turned(p.map(|x| x * self.unit_mm));
        let grains: Vec<NamedSurface> = read_surfaces(&self.surfaces, &transform)?;
        let triangles_read = grains.iter().map(|grain| grain.surface.triangles.len()).sum();
        let turned = grains.iter().filter(|grain| grain.is_turned).count();
        let volume_read_mm3 = grains.iter().map(|grain| grain.surface.volume()).sum();
        let processed = |grain: &NamedSurface| match self.smoothing_passes {
            0 => decimated(&grain.surface, self.decimation),
            passes => decimated(&grain.surface.smoothed(passes), self.decimation),
        };
        let surfaces: Vec<Surface> = grains.par_iter().map(processed).collect();
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

/// Returns the total volume of the overlaps of grains (mm³).
///
/// # Errors
/// [`SurfaceImportError::Overlap`] if the total overlap exceeds 1 % of the volume of all grains, or the overlap of one
/// pair exceeds half the volume of the smaller grain.
fn checked_overlap(surfaces: &[Surface], names: &[String]) -> Result<f64, SurfaceImportError> {
    let pairs = overlaps(surfaces);
    let all: f64 = surfaces.iter().map(Surface::volume).sum();
    let overlap_mm3: f64 = pairs.iter().map(|overlap| overlap.volume_mm3).sum();
    let share = |overlap: &&Overlap| {
        let smaller = overlap.grains.map(|grain| surfaces[grain].volume());
        overlap.volume_mm3 / smaller[0].min(smaller[1])
    };
    let Some(worst) = pairs.iter().max_by(|a, b| share(a).total_cmp(&share(b))) else {
        return Ok(0.0);
    };
    if overlap_mm3 <= MOST_OVERLAP * all && share(&worst) <= MOST_OVERLAP_OF_ONE {
        return Ok(overlap_mm3);
    }
    let [first, second] = worst.grains.map(|grain| names[grain].clone());
    Err(SurfaceImportError::Overlap {
        pairs: pairs.len(),
        share: overlap_mm3 / all,
        first,
        second,
        share_of_smaller: share(&worst),
    })
}

/// Grains from STL files, in a cylinder with its bottom at z = 0 and its axis on z.
#[derive(Clone, Debug)]
pub struct ImportedSurfaces {
    /// Name of each grain: the name of its file, followed by the number of the part if the file has several grains.
    pub names: Vec<String>,
    /// Surfaces of the grains (mm), in the coordinates of the specimen.
    pub surfaces: Vec<Surface>,
    /// Cylinder of the specimen (mm), in the coordinates of the files after the rotation of the axis.
    pub cylinder: Cylinder,
    /// Number of triangles in the files, before processing.
    pub triangles_read: usize,
    /// Volume of the grains before processing (mm³).
    pub volume_read_mm3: f64,
    /// Number of surfaces whose normals pointed inwards and were reversed.
    pub turned: usize,
    /// Factor by which each grain was scaled to separate the grains; 1 for a grain that was not shrunk.
    pub factors: Vec<f64>,
    /// Total volume of the overlaps of grains (mm³), estimated by sample points.
    pub overlap_mm3: f64,
    /// Smallest distance between any two grains (mm); 0 if two grains intersect, `None` if there is only one grain.
    pub least_gap_mm: Option<f64>,
}

impl ImportedSurfaces {
    /// Returns radius and height of the specimen (mm).
    pub fn size_mm(&self) -> [f64; 2] {
        [self.cylinder.radius_mm, self.cylinder.height_mm()]
    }

    /// Returns the total volume of the grains (mm³), including parts outside the cylinder.
    pub fn volume_mm3(&self) -> f64 {
        self.surfaces.iter().map(Surface::volume).sum()
    }

    /// Returns the total volume of the grains divided by the volume of the cylinder.
    pub fn fraction(&self) -> f64 {
        self.volume_mm3() / self.cylinder.volume_mm3()
    }

    /// Returns the grains as a [`GrainField`](crate::GrainField) for meshing.
    ///
    /// # Errors
    /// [`SurfaceError`] if a surface is not a valid grain; surfaces returned by [`SurfaceImport::read`] have been
    /// checked.
    pub fn grains(&self) -> Result<SurfaceGrains, SurfaceError> {
        let [radius_mm, height_mm] = self.size_mm();
        SurfaceGrains::new(self.surfaces.clone(), radius_mm, height_mm)
    }

    /// Checks that the size of the specimen suits the spacing of its mesh (mm).
    ///
    /// # Errors
    /// [`SurfaceImportError::Unit`] if the specimen is smaller than one spacing or larger than 2000 spacings.
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

    /// Returns a summary of the imported grains, as text.
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

    /// Returns warnings about the import, possibly none.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.turned > 0 {
            warnings.push(format!(
                "the normals of {} of {} surfaces pointed inwards and were reversed",
                self.turned,
                self.surfaces.len()
            ));
        }
        if self.overlap_mm3 > 0.0 {
            warnings.push(format!(
                "the grain fraction of the mesh is too small by the overlap of grains, {:.2} % of their volume; set \
                 least_distance_mm to separate the grains",
                100.0 * self.overlap_mm3 / self.volume_mm3()
            ));
        }
        let shrunk = self.factors.iter().filter(|&&factor| factor < 1.0).count();
        let loss = 1.0 - self.volume_mm3() / self.volume_read_mm3;
        if shrunk > 0 && loss > MOST_LOSS {
            warnings.push(format!(
                "the grain fraction is too small by {:.1} %: {shrunk} of {} grains were shrunk to reach least_distance_mm",
                100.0 * loss,
                self.surfaces.len()
            ));
        }
        warnings
    }
}
