//! Share of grain in each voxel, computed from the grey value.
//!
//! At an interface a voxel contains matrix and grain, and its grey value lies between the grey values of both
//! materials. The share of grain is assumed to be linear between the local grey values of matrix and grain, which
//! follow from a model of two materials and blur. The sum of the shares over a grain and its surroundings is the
//! grain's volume with sub-voxel accuracy; noise and blur cancel.
//!
//! A threshold given by the user defines the surface of grains, independently of the mean grey values of the materials.
//! A voxel's share then follows from the distance of its centre from the surface on which the filtered grey value
//! equals the threshold, and a grain's volume is the volume above the threshold. (In textures of low contrast, where no
//! voxel of matrix or grain is away from interfaces, shares computed from the means would sum to twice this volume.)

use rayon::prelude::*;

use crate::classify::blurred::{Blurred, FULL};
use crate::volume::filter::{core, dilate};
use crate::volume::grey::rounded;
use crate::volume::{Volume, neighbour_steps};

/// Half width of the band around an interface (voxels). Voxels outside this band ([`core`]) are not at an interface.
const BAND: usize = 2;
/// Edge length, in voxels, of the blocks over which grey values are averaged.
const BLOCK: usize = 24;
/// Number of voxels at which the mean of a block gets the same weight as the global value.
const ENOUGH: f64 = 300.0;
/// Integer that represents the volume of one voxel; volumes are summed as integers.
const UNIT: f64 = 65536.0;
/// Largest shift of the grain surfaces (voxels), see [`shift`].
const MAX_SHIFT: f64 = 0.5;
/// Number of bisection steps in the search for the shift of the grain surfaces.
const HALVINGS: usize = 16;
/// Limits to which shares of grain are clamped before they are summed. Noise lies within the limits; only pores are
/// clamped.
const CUT: [f64; 2] = [-0.5, 1.5];

/// Share of grain in each voxel, and the volumes of the grains, which are computed from the shares.
#[derive(Debug)]
pub(crate) struct Solid {
    /// Share of grain in each voxel, from 0 to 1.
    pub(crate) share: Vec<f32>,
    /// Volume of each grain (voxels); the first value belongs to grain number 1.
    pub(crate) volumes: Vec<f64>,
}

impl Solid {
    /// Computes the shares from grey values by the model of two materials and blur.
    ///
    /// A grain's volume is the volume of its voxels in the model's set, plus the difference between the image and the
    /// model in and around these voxels. The image and the model contain the same blur beyond this region, which
    /// cancels in the difference. `matrix` contains the voxels that are neither grain nor void. `shown` contains all
    /// matrix and grain voxels, and the voxels in the air beyond the wall that show blur of grains. `inside` is the specimen, and
    /// `sample` are its voxels away from walls and voids.
    pub(crate) fn measure(
        grey: &Volume<u16>,
        labels: &[u32],
        grains: usize,
        matrix: &[u8],
        [inside, shown, sample]: [&[u8]; 3],
        model: &Blurred,
    ) -> Solid {
        let shape = grey.shape;
        let grain: Vec<u8> = labels.par_iter().map(|&label| u8::from(label != 0)).collect();
        let core = core(shape, &grain);
        drop(grain);
        let levels = [false, true].map(|grain| LocalLevels::of(grey, model, sample, labels, grain));
        let mut near = labels.to_vec();
        for _ in 0..BAND {
            near = spread(shape, &near, shown);
        }

        let [nx, ny, _] = shape;
        let area = nx * ny;
        let mut share = vec![0.0_f32; labels.len()];
        let sums = share
            .par_chunks_mut(area)
            .enumerate()
            .fold(
                || vec![0_i64; grains + 1],
                |mut sums, (z, slice)| {
                    let mut lines = [vec![0.0; nx], vec![0.0; nx]];
                    for (y, row) in slice.chunks_exact_mut(nx).enumerate() {
                        let from = nx * (y + ny * z);
                        levels
                            .iter()
                            .zip(&mut lines)
                            .for_each(|(level, line)| level.row(y, z, line));
                        for (x, share) in row.iter_mut().enumerate() {
                            let at = from + x;
                            let label = near[at];
                            if label == 0 {
                                continue;
                            }
                            let (dark, bright) = (lines[0][x], lines[1][x]);
                            // a lower bound of the divisor is necessary, because noise can make the local grey value of
                            // grain smaller than the local grey value of matrix
                            let linear =
                                (f64::from(grey.values[at]) - dark) / (bright - dark).max(1.0);
                            let is_core = core[at] != 0;
                            let is_void = labels[at] == 0 && matrix[at] == 0;
                            let part = match (is_core, is_void) {
                                (true, _) => 1.0,
                                (_, true) => 0.0,
                                _ => linear.clamp(CUT[0], CUT[1]),
                            };
                            *share = part.clamp(0.0, f64::from(inside[at])) as f32;
                            let beyond = match is_core || is_void {
                                true => 0.0,
                                false => part - f64::from(model.share[at]) / f64::from(FULL),
                            };
                            // voxels of a filled hole count as grain
                            let counted = f64::from(model.set[at].max(u8::from(is_core)));
                            sums[label as usize] += rounded((counted + beyond) * UNIT) as i64;
                        }
                    }
                    sums
                },
            )
            .reduce(|| vec![0_i64; grains + 1], added);
        Solid { share, volumes: volumes(&sums) }
    }

    /// Computes the shares for a threshold given by the user, from the image to which the threshold applies (`smooth`).
    pub(crate) fn above(
        smooth: &Volume<u16>,
        threshold: f64,
        labels: &[u32],
        grains: usize,
        inside: &[u8],
    ) -> Solid {
        let near = spread(smooth.shape, labels, inside);
        let surface = Surface { smooth, threshold, labels, inside };
        let [nx, ny, _] = smooth.shape;
        // `share` contains depths below the surface until the shift of the surface is known
        let mut share = vec![f32::NEG_INFINITY; labels.len()];
        share.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
            for (n, depth) in slice.iter_mut().enumerate() {
                if near[n + nx * ny * z] != 0 {
                    *depth = surface.depth([n % nx, n / nx, z]) as f32;
                }
            }
        });
        let shift = shift(&share, labels);
        let sums = share
            .par_iter_mut()
            .enumerate()
            .with_min_len(1 << 16)
            .fold(
                || vec![0_i64; grains + 1],
                |mut sums, (at, share)| {
                    let part = part(*share, shift, labels[at]);
                    *share = part as f32;
                    sums[near[at] as usize] += rounded(part * UNIT) as i64;
                    sums
                },
            )
            .reduce(|| vec![0_i64; grains + 1], added);
        Solid { share, volumes: volumes(&sums) }
    }
}

fn added(mut a: Vec<i64>, b: Vec<i64>) -> Vec<i64> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

fn volumes(sums: &[i64]) -> Vec<f64> {
    sums[1..].iter().map(|&sum| (sum as f64 / UNIT).max(0.0)).collect()
}

/// The surface of the grains: the points at which a filtered image equals a threshold.
struct Surface<'a> {
    smooth: &'a Volume<u16>,
    threshold: f64,
    labels: &'a [u32],
    inside: &'a [u8],
}

impl Surface<'_> {
    /// Returns the depth of a voxel's centre below the surface of the grain (voxels), estimated from the gradient of
    /// the grey value. The depth is negative outside the grain, and infinite for a voxel that is enclosed by labelled
    /// voxels.
    fn depth(&self, voxel: [usize; 3]) -> f64 {
        let shape = self.smooth.shape;
        let at = voxel[0] + shape[0] * (voxel[1] + shape[1] * voxel[2]);
        let grey = |at: usize| f64::from(self.smooth.values[at]);
        let (mut slope, mut enclosed) = (0.0, self.labels[at] != 0);
        let mut stride = 1;
        for axis in 0..3 {
            let before = (voxel[axis] > 0).then(|| at - stride);
            let after = (voxel[axis] + 1 < shape[axis]).then(|| at + stride);
            // air beyond the wall does not form an interface with a grain
            let [before, after] = [before, after].map(|to| to.filter(|&to| self.inside[to] != 0));
            enclosed &= [before, after].into_iter().flatten().all(|to| self.labels[to] != 0);
            let change = grey(after.unwrap_or(at)) - grey(before.unwrap_or(at));
            slope += (0.5 * change).powi(2);
            stride *= shape[axis];
        }
        if enclosed {
            return f64::INFINITY;
        }
        (grey(at) - self.threshold) / slope.sqrt().max(1.0)
    }
}

/// Returns the share of grain in a voxel: at least 0.5 for a labelled voxel, and at most 0.5 for a voxel without a
/// label.
fn part(depth: f32, shift: f64, label: u32) -> f64 {
    let part = 0.5 + f64::from(depth) + shift;
    match label {
        0 => part.clamp(0.0, 0.5),
        _ => part.clamp(0.5, 1.0),
    }
}

/// Returns the outward shift of all grain surfaces (voxels) for which the sum of the shares equals the number of
/// labelled voxels. The shift is needed because linear interpolation between voxel centres shrinks small grains.
fn shift(depths: &[f32], labels: &[u32]) -> f64 {
    let at_surface: Vec<(f32, u32)> = depths
        .par_iter()
        .zip(labels)
        .filter(|(depth, _)| depth.is_finite())
        .map(|(&depth, &label)| (depth, label))
        .collect();
    let labelled = at_surface.par_iter().filter(|(_, label)| *label != 0).count() as f64;
    let excess = |shift: f64| -> f64 {
        let parts = at_surface.par_iter().with_min_len(1 << 16);
        let sum: i64 =
            parts.map(|&(depth, label)| rounded(part(depth, shift, label) * UNIT) as i64).sum();
        sum as f64 / UNIT - labelled
    };
    let [mut low, mut high] = [-MAX_SHIFT, MAX_SHIFT];
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

/// Dilates labels by one voxel: a voxel without a label gets the most frequent label of its neighbours, and the lowest
/// label in case of ties.
fn spread(shape: [usize; 3], labels: &[u32], inside: &[u8]) -> Vec<u32> {
    let [nx, ny, _] = shape;
    let steps: Vec<[isize; 3]> = neighbour_steps().collect();
    let grain: Vec<u8> = labels.par_iter().map(|&label| u8::from(label != 0)).collect();
    // only voxels near a grain can get a label
    let near = dilate(shape, &grain);
    let mut result = labels.to_vec();
    result.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
        let mut votes: Vec<(u32, u32)> = Vec::new();
        for (n, label_here) in slice.iter_mut().enumerate() {
            let at = n + nx * ny * z;
            if *label_here != 0 || inside[at] == 0 || near[at] == 0 {
                continue;
            }
            votes.clear();
            for &step in &steps {
                let Some(to) = stepped(shape, [n % nx, n / nx, z], step) else { continue };
                let label = labels[to];
                if label != 0 {
                    match votes.iter_mut().find(|vote| vote.0 == label) {
                        Some(vote) => vote.1 += 1,
                        None => votes.push((label, 1)),
                    }
                }
            }
            let most = votes.iter().max_by_key(|(label, count)| (*count, !*label));
            *label_here = most.map_or(0, |vote| vote.0);
        }
    });
    result
}

/// Returns the index of a voxel's neighbour; `None` beyond the edge of the volume.
fn stepped(shape: [usize; 3], voxel: [usize; 3], step: [isize; 3]) -> Option<usize> {
    let along = |k: usize| voxel[k].checked_add_signed(step[k]).filter(|&at| at < shape[k]);
    Some(along(0)? + shape[0] * (along(1)? + shape[1] * along(2)?))
}

/// Local grey values of a material (matrix or grain): one value per block of voxels. Between the centres of the blocks,
/// values are interpolated.
struct LocalLevels {
    shape: [usize; 3],
    blocks: [usize; 3],
    levels: Vec<f64>,
}

impl LocalLevels {
    /// Computes the local values: the grey value of a material (grain or matrix) in the model, plus the mean difference
    /// between image and model over the purest voxels of this material in each block. Blocks with few purest voxels get
    /// nearly the global value.
    fn of(grey: &Volume<u16>, model: &Blurred, sample: &[u8], labels: &[u32], grain: bool) -> Self {
        let shape = grey.shape;
        let blocks = shape.map(|side| (side / BLOCK).max(1));
        let [nx, ny, _] = shape;
        let count = blocks.iter().product();
        let full = f64::from(FULL);
        let contrast = model.grain - model.matrix;
        let is_pure_material = |at: usize| {
            let [most, least] = model.purest;
            let is_pure = if grain { model.share[at] >= least } else { model.share[at] <= most };
            is_pure && sample[at] != 0 && grain == (labels[at] != 0)
        };
        let sums = (0..shape[2])
            .into_par_iter()
            .fold(
                || vec![(0_u64, 0_i64); count],
                |mut sums, z| {
                    let block = |n: usize, axis: usize| n * blocks[axis] / shape[axis];
                    for n in 0..nx * ny {
                        let at = n + nx * ny * z;
                        if !is_pure_material(at) {
                            continue;
                        }
                        let [i, j, k] = [block(n % nx, 0), block(n / nx, 1), block(z, 2)];
                        let sum = &mut sums[i + blocks[0] * (j + blocks[1] * k)];
                        let share = f64::from(model.share[at]) / full;
                        let beyond = f64::from(grey.values[at]) - model.matrix - contrast * share;
                        *sum = (sum.0 + 1, sum.1 + rounded(beyond * UNIT) as i64);
                    }
                    sums
                },
            )
            .reduce(
                || vec![(0, 0); count],
                |mut a, b| {
                    a.iter_mut().zip(b).for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1));
                    a
                },
            );
        let global = if grain { model.grain } else { model.matrix };
        let level =
            |&(count, sum): &(u64, i64)| global + sum as f64 / UNIT / (count as f64 + ENOUGH);
        LocalLevels { shape, blocks, levels: sums.iter().map(level).collect() }
    }

    /// Returns the two blocks whose centres enclose voxel `n` along an axis, and the interpolation weight of the second
    /// block.
    fn between(&self, n: usize, axis: usize) -> (usize, usize, f64) {
        let last = self.blocks[axis] - 1;
        let position = (n as f64 + 0.5) * self.blocks[axis] as f64 / self.shape[axis] as f64 - 0.5;
        let position = position.clamp(0.0, last as f64);
        let first = position as usize;
        (first, (first + 1).min(last), position - first as f64)
    }

    /// Interpolates the local grey values of a row of voxels.
    fn row(&self, y: usize, z: usize, line: &mut [f64]) {
        let (j0, j1, q) = self.between(y, 1);
        let (k0, k1, r) = self.between(z, 2);
        let at = |i: usize, j: usize, k: usize| {
            self.levels[i + self.blocks[0] * (j + self.blocks[1] * k)]
        };
        let column = |i: usize| {
            let low = at(i, j0, k0) * (1.0 - q) + at(i, j1, k0) * q;
            let high = at(i, j0, k1) * (1.0 - q) + at(i, j1, k1) * q;
            low * (1.0 - r) + high * r
        };
        let columns: Vec<f64> = (0..self.blocks[0]).map(column).collect();
        for (x, value) in line.iter_mut().enumerate() {
            let (i0, i1, p) = self.between(x, 0);
            *value = columns[i0] * (1.0 - p) + columns[i1] * p;
        }
    }
}
