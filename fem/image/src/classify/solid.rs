//! How much of each voxel is grain, from its grey value.
//!
//! At an interface a voxel holds matrix and grain, and its grey value lies between theirs. The share of
//! grain is taken as linear between the grey values of matrix and grain nearby, which a model of their blur
//! finds. Summed over a grain and what surrounds it this gives its volume between voxels, and noise
//! and blur cancel.
//!
//! A threshold that was given by hand says where grains end, whatever the means are: then a voxel's share
//! follows from how far its centre is from the surface on which the filtered grey value passes the
//! threshold, and a grain's volume is what is above it. (In textures of little contrast the shares between
//! the means would come to twice that, with nothing of matrix or grain that is away from interfaces.)

use rayon::prelude::*;

use crate::classify::blurred::{Blurred, FULL};
use crate::volume::filter::{core, dilate};
use crate::volume::grey::rounded;
use crate::volume::{Volume, neighbour_steps};

/// Voxels so far inside a phase ([`core`]), or outside, are not at an interface.
const BAND: usize = 2;
/// Voxels along the edge of a block in which grey values are averaged.
const BLOCK: usize = 24;
/// The grey values of a block count as much as those of all blocks when it has so many voxels.
const ENOUGH: f64 = 300.0;
/// One voxel, in the integers in which volumes are summed.
const UNIT: f64 = 65536.0;
/// A surface is moved by at most this distance (voxels), which is found by this number of halvings.
const FURTHEST: f64 = 0.5;
const HALVINGS: usize = 16;
/// Shares are cut here before they are summed: noise passes, pores do not.
const CUT: [f64; 2] = [-0.5, 1.5];

/// Grain shares of voxels, and volumes of grains from them.
#[derive(Debug)]
pub(crate) struct Solid {
    pub(crate) share: Vec<f32>,
    /// Volume of each grain, from number 1 on (voxels).
    pub(crate) volumes: Vec<f64>,
}

impl Solid {
    /// The shares that grey values show, by the model of two materials and their blur.
    ///
    /// A grain's volume is that of its voxels in the model's set, and what the grey values show more or less than the
    /// model predicts in and around these: blur that reaches further than what is looked at is in both.
    /// `matrix` holds the voxels that are neither grain nor void. Each of these and of the grains is in `shown`, which
    /// holds the voxels beyond the wall too that show blur of grains. `inside` is the specimen, and `sample` are its voxels
    /// that are away from walls and voids.
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
                            // levels on the wrong sides of each other, by noise, make a step
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
                            // a hole that was filled is grain
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

    /// Shares for a threshold that was given, from the image that was compared with it (`smooth`).
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
        // depths first, shares then
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

/// Where a filtered image passes a threshold.
struct Surface<'a> {
    smooth: &'a Volume<u16>,
    threshold: f64,
    labels: &'a [u32],
    inside: &'a [u8],
}

impl Surface<'_> {
    /// How far a voxel's centre is within the surface (voxels), if the grey value is linear in it; infinite for a voxel that
    /// labels enclose.
    fn depth(&self, voxel: [usize; 3]) -> f64 {
        let shape = self.smooth.shape;
        let at = voxel[0] + shape[0] * (voxel[1] + shape[1] * voxel[2]);
        let grey = |at: usize| f64::from(self.smooth.values[at]);
        let (mut slope, mut enclosed) = (0.0, self.labels[at] != 0);
        let mut stride = 1;
        for axis in 0..3 {
            let before = (voxel[axis] > 0).then(|| at - stride);
            let after = (voxel[axis] + 1 < shape[axis]).then(|| at + stride);
            // air beyond the wall is no interface of a grain
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

/// How much of a voxel is grain: at least half of one that has a label, and at most half of one that has none.
fn part(depth: f32, shift: f64, label: u32) -> f64 {
    let part = 0.5 + f64::from(depth) + shift;
    match label {
        0 => part.clamp(0.0, 0.5),
        _ => part.clamp(0.5, 1.0),
    }
}

/// How far the surface of all grains is moved out so that shares add up to the labelled voxels (voxels). Linear
/// interpolation between the centres of voxels makes small grains smaller.
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
    let [mut low, mut high] = [-FURTHEST, FURTHEST];
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

/// Labels grown by one voxel: a bare voxel takes the label that most of its neighbours have, of equal
/// ones the lowest.
fn spread(shape: [usize; 3], labels: &[u32], inside: &[u8]) -> Vec<u32> {
    let [nx, ny, _] = shape;
    let steps: Vec<[isize; 3]> = neighbour_steps().collect();
    let grain: Vec<u8> = labels.par_iter().map(|&label| u8::from(label != 0)).collect();
    // most bare voxels are near no grain
    let near = dilate(shape, &grain);
    let mut result = labels.to_vec();
    result.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
        let mut votes: Vec<(u32, u32)> = Vec::new();
        for (n, own) in slice.iter_mut().enumerate() {
            let at = n + nx * ny * z;
            if *own != 0 || inside[at] == 0 || near[at] == 0 {
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
            *own = most.map_or(0, |vote| vote.0);
        }
    });
    result
}

/// The place of a voxel's neighbour, or nothing beyond the edge.
fn stepped(shape: [usize; 3], voxel: [usize; 3], step: [isize; 3]) -> Option<usize> {
    let along = |k: usize| voxel[k].checked_add_signed(step[k]).filter(|&at| at < shape[k]);
    Some(along(0)? + shape[0] * (along(1)? + shape[1] * along(2)?))
}

/// The grey value of a material in blocks, interpolated between their centres.
struct LocalLevels {
    shape: [usize; 3],
    blocks: [usize; 3],
    levels: Vec<f64>,
}

impl LocalLevels {
    /// The material's grey value in the model, and how far grey values of a block differ from what the model predicts:
    /// by the mean over the purest voxels of this material, which a few voxels change little.
    fn of(grey: &Volume<u16>, model: &Blurred, sample: &[u8], labels: &[u32], grain: bool) -> Self {
        let shape = grey.shape;
        let blocks = shape.map(|side| (side / BLOCK).max(1));
        let [nx, ny, _] = shape;
        let count = blocks.iter().product();
        let full = f64::from(FULL);
        let contrast = model.grain - model.matrix;
        let is_of_it = |at: usize| {
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
                        if !is_of_it(at) {
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

    /// The two blocks between whose centres a voxel lies, and the share of the second.
    fn between(&self, n: usize, axis: usize) -> (usize, usize, f64) {
        let last = self.blocks[axis] - 1;
        let place = (n as f64 + 0.5) * self.blocks[axis] as f64 / self.shape[axis] as f64 - 0.5;
        let place = place.clamp(0.0, last as f64);
        let first = place as usize;
        (first, (first + 1).min(last), place - first as f64)
    }

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
