//! A virtual CT scanner: synthetic images of grains with known ground truth.

mod tomography;
mod voxelize;

use rand::SeedableRng;
use rand_distr::{Distribution, Poisson, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::specimen::grains::GrainField;
use fem_image::{Cylinder, Volume};
use tomography::ScanGeometry;
use voxelize::{Grid, mixed};

/// Spectrum of the beam. Each entry describes one photon energy by its fraction of all photons, and by its attenuation
/// relative to the attenuation of the middle energy.
const BEAM: [(f64, f64); 3] = [(0.3, 1.6), (0.4, 1.0), (0.3, 0.7)];
/// Line integral of the attenuation along the diameter of a specimen of matrix (dimensionless).
const MATRIX: f64 = 1.0;
/// Grey value of air.
const AIR: f32 = 8000.0;
/// Difference of the grey values of matrix and air.
const CONTRAST: f32 = 20000.0;
/// Edge length of the cells of the random texture (voxels).
const TEXTURE_CELL: f64 = 4.0;
/// Expected photon count above which the normal distribution replaces the Poisson distribution.
const NORMAL_COUNT: f64 = 1000.0;
/// Largest number of voxels of a scan; a larger number is reported as a likely error in the units.
const MAX_VOXELS: f64 = 1.0e9;

/// A parallel-beam scanner with a polychromatic source, a photon-counting detector with blur and non-uniform gain,
/// and reconstruction by filtered back-projection.
///
/// # Example
/// ```
/// use fem_mesh::{Grain, GrainList, Scanner};
///
/// let grains = GrainList::new(vec![Grain::sphere([0.0, 0.0, 0.5], 0.3)], 0.6, 1.0);
/// let scan = Scanner::new(0.03, 1).scan(0.6, 1.0, &grains)?;
/// let [x, y, z] = scan.labels.shape.map(|n| n / 2);
/// let middle = x + scan.labels.shape[0] * (y + scan.labels.shape[1] * z);
/// assert_eq!(scan.labels.values[middle], 1);
/// assert!(scan.grey.values[middle] > 2.0 * scan.grey.values[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scanner {
    /// Edge length of a voxel (mm).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub voxel_mm: f64,
    /// Seed of the random noise, ring artefacts and texture.
    #[serde(default)]
    pub seed: u64,
    /// Width of the air around the cylinder (voxels).
    #[serde(default = "default_margin")]
    #[schemars(range(min = 2, max = 1000))]
    pub margin: usize,
    /// Inclination of the specimen's axis: displacement along x and y per mm along z.
    #[serde(default)]
    #[schemars(inner(range(min = -0.3, max = 0.3)))]
    pub lean: [f64; 2],
    /// Number of projection directions over 180°. The value 0 stands for the width of a slice in voxels.
    #[serde(default)]
    #[schemars(range(min = 0, max = 100_000))]
    pub projections: usize,
    /// Expected photon count of a detector pixel without specimen.
    #[serde(default = "default_photons")]
    #[schemars(range(min = 10, max = 1e12))]
    pub photons: f64,
    /// Ratio of the attenuation of the grains to the attenuation of the matrix.
    #[serde(default = "default_attenuation")]
    #[schemars(range(min = 0, max = 20))]
    pub grain_attenuation: f64,
    /// Strength of beam hardening: 0 for a monochromatic beam, 1 for a broad spectrum.
    #[serde(default = "default_hardening")]
    #[schemars(range(min = 0, max = 1))]
    pub hardening: f64,
    /// Standard deviation of the Gaussian blur (voxels).
    #[serde(default = "default_blur")]
    #[schemars(range(min = 0, max = 10))]
    pub blur: f64,
    /// Standard deviation of the relative gains of the detector pixels. Different gains cause ring artefacts.
    #[serde(default = "default_rings")]
    #[schemars(range(min = 0, max = 0.5))]
    pub rings: f64,
    /// Largest relative change of the attenuation by random texture. The texture represents structures that the scanner
    /// does not resolve.
    #[serde(default = "default_texture")]
    #[schemars(range(min = 0, max = 0.9))]
    pub texture: f64,
}

fn default_margin() -> usize {
    6
}

fn default_photons() -> f64 {
    1e5
}

fn default_attenuation() -> f64 {
    1.8
}

fn default_hardening() -> f64 {
    0.3
}

fn default_blur() -> f64 {
    0.7
}

fn default_rings() -> f64 {
    0.001
}

fn default_texture() -> f64 {
    0.05
}

/// A simulated scan with its ground truth.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Grey values, integers from 0 to 65535.
    pub grey: Volume<f32>,
    /// For each voxel, the number of the grain that contains the centre of the voxel, or 0.
    pub labels: Volume<u32>,
    /// Position of the specimen in the scanned volume.
    pub cylinder: Cylinder,
}

/// Error of a scan that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} = {value}; give {requirement}")]
pub struct ScanError {
    /// Name of the setting.
    pub field: &'static str,
    /// Value of the setting.
    pub value: f64,
    /// Allowed values.
    pub requirement: &'static str,
}

impl Scanner {
    /// Creates default settings: a scanner of good quality.
    pub fn new(voxel_mm: f64, seed: u64) -> Scanner {
        Scanner {
            voxel_mm,
            seed,
            margin: default_margin(),
            lean: [0.0; 2],
            projections: 0,
            photons: default_photons(),
            grain_attenuation: default_attenuation(),
            hardening: default_hardening(),
            blur: default_blur(),
            rings: default_rings(),
            texture: default_texture(),
        }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// [`ScanError`] for the first setting out of range.
    pub fn validate(&self) -> Result<(), ScanError> {
        let rules = [
            ("voxel_mm", self.voxel_mm, self.voxel_mm > 0.0, "a length above 0 (mm)"),
            (
                "margin",
                self.margin as f64,
                (2..=1000).contains(&self.margin),
                "from 2 to 1000 voxels",
            ),
            ("lean", self.lean[0], self.lean[0].abs() <= 0.3, "slopes from -0.3 to 0.3"),
            ("lean", self.lean[1], self.lean[1].abs() <= 0.3, "slopes from -0.3 to 0.3"),
            (
                "projections",
                self.projections as f64,
                self.projections == 0 || (8..=100_000).contains(&self.projections),
                "0, or from 8 to 100000 directions",
            ),
            (
                "photons",
                self.photons,
                (10.0..=1e12).contains(&self.photons),
                "a count from 10 to 1e12",
            ),
            (
                "grain_attenuation",
                self.grain_attenuation,
                (0.0..=20.0).contains(&self.grain_attenuation),
                "a ratio from 0 to 20",
            ),
            ("hardening", self.hardening, (0.0..=1.0).contains(&self.hardening), "from 0 to 1"),
            ("blur", self.blur, (0.0..=10.0).contains(&self.blur), "from 0 to 10 voxels"),
            ("rings", self.rings, (0.0..=0.5).contains(&self.rings), "from 0 to 0.5"),
            ("texture", self.texture, (0.0..=0.9).contains(&self.texture), "from 0 to 0.9"),
        ];
        match rules.into_iter().find(|&(_, value, holds, _)| !(holds && value.is_finite())) {
            Some((field, value, _, requirement)) => Err(ScanError { field, value, requirement }),
            None => Ok(()),
        }
    }

    /// Scans a cylinder (mm) with its bottom at z = 0 and its axis on z; in the image, the axis of the cylinder is
    /// inclined by `lean`. The same seed gives the same volume for any number of threads.
    ///
    /// # Errors
    /// [`ScanError`] if a setting is out of range, or the cylinder has too many or too few voxels.
    pub fn scan(
        &self,
        radius_mm: f64,
        height_mm: f64,
        grains: &dyn GrainField,
    ) -> Result<Scan, ScanError> {
        self.validate()?;
        for (field, value) in [("radius_mm", radius_mm), ("height_mm", height_mm)] {
            if !(value.is_finite() && value >= 2.0 * self.voxel_mm) {
                let requirement = "a length of at least two voxels (mm)";
                return Err(ScanError { field, value, requirement });
            }
        }
        let across =
            |length: f64| (length / self.voxel_mm - 1e-9).ceil() + 2.0 * self.margin as f64;
        // an inclined specimen needs wider slices; widen both edges of a slice, because slices are square
        let slope = self.lean[0].hypot(self.lean[1]);
        let (sin, cos) = slope.atan().sin_cos();
        let width = across(2.0 * radius_mm + height_mm * sin);
        let slices = across(height_mm * cos + 2.0 * radius_mm * sin);
        let voxels = width * width * slices;
        if voxels > MAX_VOXELS {
            let requirement = "a larger voxel: at most 1e9 voxels are supported";
            return Err(ScanError { field: "voxel_mm", value: self.voxel_mm, requirement });
        }
        let (width, slices) = (width as usize, slices as usize);
        let shape = [width, width, slices];
        let size = shape.map(|count| count as f64 * self.voxel_mm);
        let bottom_mm = 0.5 * (size[2] - height_mm);
        let cylinder = Cylinder {
            centre_mm: [0.5 * size[0], 0.5 * size[1]],
            radius_mm,
            bottom_mm,
            top_mm: bottom_mm + height_mm,
            lean: self.lean,
        };
        let grid = Grid { shape, voxel_mm: self.voxel_mm, cylinder };
        let (labels, mut shares) = grid.fill(grains, radius_mm, height_mm);
        grid.texture(&mut shares, self.texture, TEXTURE_CELL, mixed(self.seed));
        grid.blur(&mut shares, self.blur);

        let projections = if self.projections == 0 { width } else { self.projections };
        let geometry = ScanGeometry::new(width, projections);
        let per_voxel = MATRIX * self.voxel_mm / (2.0 * radius_mm);
        let slice = |(k, maps): (usize, &[[f32; 2]])| {
            let seed = mixed(self.seed ^ mixed(k as u64 + 1));
            let integrals = self.count(&geometry.project(maps), width, per_voxel, seed);
            let map = geometry.reconstruct(&integrals);
            let grey = move |x: f32| (AIR + CONTRAST * x / per_voxel as f32).round();
            map.into_iter().map(move |x| grey(x).clamp(0.0, 65535.0))
        };
        let grey = shares.par_chunks(width * width).enumerate().flat_map_iter(slice).collect();
        let voxel_mm = self.voxel_mm;
        Ok(Scan {
            grey: Volume { shape, voxel_mm, values: grey },
            labels: Volume { shape, voxel_mm, values: labels },
            cylinder,
        })
    }

    /// Simulates the detector: returns the measured line integrals of the attenuation (negative logarithms of relative
    /// photon counts). `lengths` are the path lengths in matrix and grain (voxels).
    fn count(&self, lengths: &[[f32; 2]], width: usize, per_voxel: f64, seed: u64) -> Vec<f32> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let gains: Vec<f64> = (0..width).map(|_| (1.0 + self.rings * normal()).max(0.1)).collect();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(mixed(seed));
        let measured = |(k, &[matrix, grain]): (usize, &[f32; 2])| {
            let length = f64::from(matrix) + self.grain_attenuation * f64::from(grain);
            let passes: f64 = BEAM
                .iter()
                .map(|&(share, ratio)| {
                    let ratio = 1.0 + self.hardening * (ratio - 1.0);
                    share * (-ratio * per_voxel * length).exp()
                })
                .sum();
            let mean = self.photons * gains[k % width] * passes;
            let noise: f64 = StandardNormal.sample(&mut rng);
            let counted = match Poisson::new(mean) {
                Ok(poisson) if mean < NORMAL_COUNT => poisson.sample(&mut rng),
                _ => mean + mean.sqrt() * noise,
            };
            -(counted.max(0.5) / self.photons).ln() as f32
        };
        lengths.iter().enumerate().map(measured).collect()
    }
}
