//! Synthetic images of packings with known ground truth: matrix and grains in air, with cupping, blur and noise.

use std::f64::consts::PI;

use fem_image::Volume;

use fem_mesh::{Grain, Packing, SizeClass};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Edge length of a voxel (mm).
pub(crate) const VOXEL_MM: f64 = 0.01;
/// Brightness of matrix and grains; the brightness of air is 0.
const MATRIX: f32 = 0.45;
const GRAIN: f32 = 1.0;

/// Settings of a synthetic image of a packing in a cylinder in air.
#[derive(Clone, Debug)]
pub(crate) struct Phantom {
    /// Number of voxels along each edge of the image.
    pub(crate) side: usize,
    /// Volume fraction of the grains in the cylinder.
    pub(crate) fraction: f64,
    /// Median radius (voxels) and volume share of each size class.
    pub(crate) radii: Vec<(f64, f64)>,
    /// Minimum thickness of matrix between grains (voxels).
    pub(crate) film: f64,
    /// Fraction of the matrix that consists of grains too fine to be resolved.
    pub(crate) fines: f32,
    /// Relative increase of brightness from the axis to the wall.
    pub(crate) cupping: f32,
    /// Standard deviation of the blur (voxels).
    pub(crate) blur: f64,
    /// Standard deviation of the noise (brightness).
    pub(crate) noise: f32,
    /// Seed of packing and noise.
    pub(crate) seed: u64,
}

/// A synthetic image with its ground truth.
#[derive(Clone, Debug)]
pub(crate) struct Imaged {
    pub(crate) image: Volume<f32>,
    pub(crate) truth: Volume<u32>,
    pub(crate) volumes_mm3: Vec<f64>,
    /// Volume of the specimen, voids excluded.
    pub(crate) specimen_mm3: f64,
    pub(crate) radius_mm: f64,
    pub(crate) bottom_mm: f64,
    pub(crate) height_mm: f64,
    pub(crate) centre_mm: [f64; 2],
}

impl Phantom {
    /// Settings for grains of one size, with noise of a tenth of the contrast.
    pub(crate) fn new(side: usize, fraction: f64, radius: f64, film: f64) -> Self {
        Phantom {
            side,
            fraction,
            radii: vec![(radius, 1.0)],
            film,
            fines: 0.0,
            cupping: 0.12,
            blur: 0.8,
            noise: 0.05,
            seed: 1,
        }
    }

    /// Draws the packing and computes the image.
    pub(crate) fn take(&self) -> Imaged {
        let side = self.side as f64;
        let (radius, height) = (0.45 * side, 0.9 * side);
        let sizes = self.radii.iter().map(|&(radius, share)| SizeClass {
            median_radius_mm: radius * VOXEL_MM,
            spread: 0.15,
            share,
        });
        let packing = Packing {
            sizes: sizes.collect(),
            film_mm: self.film * VOXEL_MM,
            ..Packing::new(self.fraction, self.seed)
        };
        let grains =
            packing.fill(radius * VOXEL_MM, height * VOXEL_MM).expect("the packing can be made");
        let centre = [0.5 * side + 0.3, 0.5 * side - 0.2];
        self.image_of(&grains, centre, 0.05 * side, radius, height)
    }

    fn image_of(
        &self,
        grains: &[Grain],
        centre: [f64; 2],
        bottom: f64,
        radius: f64,
        height: f64,
    ) -> Imaged {
        let n = self.side;
        let shape = [n; 3];
        let mut share = vec![0.0_f32; n * n * n];
        let mut truth = vec![0_u32; n * n * n];
        let shift = [centre[0], centre[1], bottom];
        for (number, grain) in grains.iter().enumerate() {
            let middle: [f64; 3] = std::array::from_fn(|a| grain.centre[a] / VOXEL_MM + shift[a]);
            let reach = grain.bounding_radius_mm() / VOXEL_MM + 2.0;
            let range = |a: usize| {
                let low = (middle[a] - reach).max(0.0) as usize;
                low..((middle[a] + reach).max(0.0) as usize + 1).min(n)
            };
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let at = [x, y, z];
                        let point =
                            std::array::from_fn(|a| (at[a] as f64 + 0.5 - shift[a]) * VOXEL_MM);
                        let off = grain.signed_distance_mm(point) / VOXEL_MM;
                        let voxel = x + n * (y + n * z);
                        share[voxel] += (0.5 - off).clamp(0.0, 1.0) as f32;
                        if off < 0.0 {
                            truth[voxel] = number as u32 + 1;
                        }
                    }
                }
            }
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed ^ 0x5ca7);
        let mut values = vec![0.0_f32; n * n * n];
        for (at, value) in values.iter_mut().enumerate() {
            let [x, y, z] = [at % n, at / n % n, at / (n * n)].map(|c| c as f64 + 0.5);
            let r = (x - centre[0]).hypot(y - centre[1]);
            let outside = (r - radius).max(bottom - z).max(z - bottom - height);
            let solid = (0.5 - outside).clamp(0.0, 1.0) as f32;
            let part = share[at].min(1.0);
            let fine =
                if self.fines > 0.0 && rand::Rng::random_bool(&mut rng, f64::from(self.fines)) {
                    GRAIN - MATRIX
                } else {
                    0.0
                };
            let material = MATRIX + fine * (1.0 - part) + (GRAIN - MATRIX) * part;
            let s = (r / radius).min(1.0).powi(2) as f32;
            *value = solid * material * (1.0 + self.cupping * s) / (1.0 + 0.5 * self.cupping);
        }
        blur(&mut values, n, self.blur);
        for value in &mut values {
            let noise: f32 = StandardNormal.sample(&mut rng);
            *value = ((*value + self.noise * noise) * 20_000.0 + 12_000.0).round();
        }
        Imaged {
            image: Volume::new(shape, VOXEL_MM, values).expect("a volume"),
            truth: Volume::new(shape, VOXEL_MM, truth).expect("a volume"),
            volumes_mm3: grains.iter().map(Grain::volume_mm3).collect(),
            specimen_mm3: PI * radius * radius * height * VOXEL_MM.powi(3),
            radius_mm: radius * VOXEL_MM,
            bottom_mm: bottom * VOXEL_MM,
            height_mm: height * VOXEL_MM,
            centre_mm: centre.map(|c| c * VOXEL_MM),
        }
    }
}

impl Imaged {
    /// Returns the volume fraction of the grains in the specimen.
    pub(crate) fn fraction(&self) -> f64 {
        self.volumes_mm3.iter().sum::<f64>() / self.specimen_mm3
    }
}

/// Convolves an image of n³ voxels with a Gaussian along each axis.
pub(crate) fn blur(values: &mut [f32], n: usize, deviation: f64) {
    if deviation <= 0.0 {
        return;
    }
    let reach = (4.0 * deviation).ceil() as usize;
    let weight = |d: f64| (-0.5 * (d / deviation).powi(2)).exp();
    let all: f64 = (0..=2 * reach).map(|k| weight(k as f64 - reach as f64)).sum();
    let kernel: Vec<f32> =
        (0..=2 * reach).map(|k| (weight(k as f64 - reach as f64) / all) as f32).collect();
    let mut line = vec![0.0; n];
    for stride in [1, n, n * n] {
        for start in (0..n * n * n).filter(|at| at / stride % n == 0) {
            for (x, value) in line.iter_mut().enumerate() {
                *value = (0..=2 * reach)
                    .map(|k| {
                        let from = (x + k).saturating_sub(reach).min(n - 1);
                        kernel[k] * values[start + from * stride]
                    })
                    .sum();
            }
            for (x, value) in line.iter().enumerate() {
                values[start + x * stride] = *value;
            }
        }
    }
}
