//! Grains on a voxel grid: labels, volume fractions of the phases, blur, texture.

use rayon::prelude::*;

use crate::specimen::grains::GrainField;
use fem_image::Cylinder;

/// Number of consecutive voxels along x for which nearby grains are searched only once.
const RUN: usize = 8;

/// A voxel grid around a cylinder: the centre of voxel (i, j, k) is `(i + ½, j + ½, k + ½) · voxel_mm` in the image.
pub(super) struct Grid {
    pub(super) shape: [usize; 3],
    pub(super) voxel_mm: f64,
    pub(super) cylinder: Cylinder,
}

impl Grid {
    /// Converts a point of the image (voxels) to the specimen's coordinates (mm).
    fn point(&self, at: [f64; 3]) -> [f64; 3] {
        self.cylinder.to_specimen(at.map(|x| x * self.voxel_mm))
    }

    /// Returns, for each voxel, the number of the grain at the centre of the voxel (or 0) and the volume fractions of
    /// matrix and grain in the voxel.
    pub(super) fn fill(
        &self,
        field: &dyn GrainField,
        radius: f64,
        height: f64,
    ) -> (Vec<u32>, Vec<[f32; 2]>) {
        let [nx, ny, nz] = self.shape;
        let row = |row: usize| {
            let (j, k) = (row % ny, row / ny);
            let mut values = Vec::with_capacity(nx);
            let mut near = Vec::new();
            for i in 0..nx {
                let [x, y, z] = [i, j, k].map(|x| x as f64 + 0.5);
                if i % RUN == 0 {
                    let half = 0.5 * RUN as f64;
                    near.clear();
                    let middle = self.point([x - 0.5 + half, y, z]);
                    field.near(middle, (half + 1.0) * self.voxel_mm, &mut near);
                }
                let x = self.point([x, y, z]);
                values.push(self.voxel(field, &near, x, radius, height));
            }
            values
        };
        (0..ny * nz).into_par_iter().flat_map_iter(row).unzip()
    }

    /// Returns the number of the grain at the centre `x` (mm) of a voxel (or 0) and the volume fractions of matrix and
    /// grain. `near` lists the grains near the voxel.
    fn voxel(
        &self,
        field: &dyn GrainField,
        near: &[u32],
        x: [f64; 3],
        radius: f64,
        height: f64,
    ) -> (u32, [f32; 2]) {
        let share = |distance: f64| (0.5 - distance / self.voxel_mm).clamp(0.0, 1.0);
        let wall = x[0].hypot(x[1]) - radius;
        let body = share(wall) * share(-x[2]) * share(x[2] - height);
        if body == 0.0 {
            return (0, [0.0; 2]);
        }
        let (mut nearest, mut label, mut grain) = (0.0, 0, 0.0);
        for &number in near {
            if let Some(distance) = field.distance_below(number, x, 0.5 * self.voxel_mm) {
                grain += share(distance);
                if distance < nearest {
                    (nearest, label) = (distance, number);
                }
            }
        }
        let grain = grain.min(body);
        let is_inside = wall < 0.0 && (0.0..height).contains(&x[2]);
        (if is_inside { label } else { 0 }, [(body - grain) as f32, grain as f32])
    }

    /// Convolves the fractions with a Gaussian of standard deviation `sigma` (voxels); outside the grid the fractions
    /// are zero (air).
    pub(super) fn blur(&self, values: &mut [[f32; 2]], sigma: f64) {
        if sigma <= 0.0 {
            return;
        }
        let reach = (3.0 * sigma).ceil() as usize;
        let mut taps: Vec<f32> =
            (0..=reach).map(|n| (-0.5 * (n as f64 / sigma).powi(2)).exp() as f32).collect();
        let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f32>();
        taps.iter_mut().for_each(|tap| *tap /= sum);
        let [nx, ny, _] = self.shape;
        for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
            let count = self.shape[axis];
            let before = values.to_vec();
            values.par_iter_mut().enumerate().for_each(|(at, value)| {
                let along = at / stride % count;
                let mut sum = before[at].map(|x| x * taps[0]);
                for (n, &tap) in taps.iter().enumerate().skip(1) {
                    for other in [
                        (along >= n).then(|| at - n * stride),
                        (along + n < count).then(|| at + n * stride),
                    ] {
                        let [a, b] = other.map_or([0.0; 2], |other| before[other]);
                        sum = [sum[0] + tap * a, sum[1] + tap * b];
                    }
                }
                *value = sum;
            });
        }
    }

    /// Multiplies each value by 1 + `amplitude` · n, where n is a smooth noise in [−1, 1] with cells of `cell` voxels.
    pub(super) fn texture(&self, values: &mut [[f32; 2]], amplitude: f64, cell: f64, seed: u64) {
        if amplitude <= 0.0 {
            return;
        }
        let [nx, ny, _] = self.shape;
        values.par_chunks_mut(nx).enumerate().for_each(|(row, values)| {
            let (j, k) = (row % ny, row / ny);
            for (i, value) in values.iter_mut().enumerate().filter(|(_, v)| **v != [0.0; 2]) {
                let noise = noise([i, j, k].map(|x| x as f64 / cell), seed);
                let factor = (1.0 + amplitude * noise) as f32;
                *value = value.map(|x| x * factor);
            }
        });
    }
}

/// Returns the value of a noise field in [−1, 1]. The values at integer coordinates are random; between these
/// coordinates, values are interpolated linearly.
fn noise(x: [f64; 3], seed: u64) -> f64 {
    let cell = x.map(|x| x.floor());
    let t: [f64; 3] = std::array::from_fn(|k| x[k] - cell[k]);
    let corner = |c: usize| {
        let mut hash = seed;
        for (axis, cell) in cell.iter().enumerate() {
            hash = mixed(hash ^ (*cell as u64 + (c >> axis & 1) as u64));
        }
        2.0 * (hash >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    };
    let weight = |c: usize| -> f64 {
        (0..3).map(|k| if c >> k & 1 == 1 { t[k] } else { 1.0 - t[k] }).product()
    };
    (0..8).map(|c| weight(c) * corner(c)).sum()
}

/// Returns a hash of `x` (splitmix64): each bit of the hash depends on all bits of `x`.
pub(super) fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}
