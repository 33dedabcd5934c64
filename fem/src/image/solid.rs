//! How much of each voxel is grain, from its grey value.
//!
//! At an interface a voxel holds matrix and grain, and its grey value lies between theirs. The share of
//! grain is taken as linear between the mean grey values of matrix and grain nearby, measured away from
//! interfaces. Summed over a grain and what surrounds it this gives its volume between voxels, and noise
//! and blur cancel.

use rayon::prelude::*;

use super::filter::erode;
use super::volume::{Volume, neighbour_steps};

/// Voxels so far inside a phase, or outside, are not at an interface.
const BAND: usize = 2;
/// Voxels along the edge of a block in which grey values are averaged.
const BLOCK: usize = 24;
/// A block's own mean counts as much as that of all when it has so many voxels.
const ENOUGH: f64 = 300.0;
/// One voxel, in the integers in which volumes are summed.
const UNIT: f64 = 65536.0;
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
    /// `matrix` holds the voxels of the specimen that are neither grain nor void, `inside` the
    /// specimen.
    pub(crate) fn measure(
        grey: &Volume<u16>,
        labels: &[u32],
        grains: usize,
        matrix: &[u8],
        inside: &[u8],
    ) -> Solid {
        let shape = grey.shape;
        let grain: Vec<u8> = labels.par_iter().map(|&label| u8::from(label != 0)).collect();
        let core = (0..BAND).fold(grain, |set, _| erode(shape, &set));
        let matrix_core = (0..BAND).fold(matrix.to_vec(), |set, _| erode(shape, &set));
        let safe = (0..BAND).fold(inside.to_vec(), |set, _| erode(shape, &set));
        let levels = [
            LocalMeans::of(shape, &grey.values, &matrix_core),
            LocalMeans::of(shape, &grey.values, &core),
        ];
        drop(matrix_core);
        let mut near = labels.to_vec();
        for _ in 0..BAND {
            near = spread(shape, &near, inside);
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
                            let linear = (f64::from(grey.values[at]) - dark) / (bright - dark);
                            let part = if core[at] != 0 {
                                1.0
                            } else if labels[at] == 0 && matrix[at] == 0 {
                                0.0
                            } else if safe[at] == 0 {
                                linear.clamp(0.0, 1.0)
                            } else {
                                linear.clamp(CUT[0], CUT[1])
                            };
                            *share = part.clamp(0.0, 1.0) as f32;
                            sums[label as usize] += (part * UNIT).round() as i64;
                        }
                    }
                    sums
                },
            )
            .reduce(
                || vec![0_i64; grains + 1],
                |mut a, b| {
                    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                    a
                },
            );
        let volumes = sums[1..].iter().map(|&sum| (sum as f64 / UNIT).max(0.0)).collect();
        Solid { share, volumes }
    }
}

/// Labels grown by one voxel: a bare voxel takes the label that most of its neighbours have, of equal
/// ones the lowest.
fn spread([nx, ny, nz]: [usize; 3], labels: &[u32], inside: &[u8]) -> Vec<u32> {
    let steps: Vec<[isize; 3]> = neighbour_steps().collect();
    let mut result = labels.to_vec();
    result.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
        let mut votes: Vec<(u32, u32)> = Vec::new();
        for (n, own) in slice.iter_mut().enumerate() {
            if *own != 0 || inside[n + nx * ny * z] == 0 {
                continue;
            }
            let (x, y) = (n % nx, n / nx);
            votes.clear();
            for [i, j, k] in &steps {
                let to = (
                    x.checked_add_signed(*i).filter(|&x| x < nx),
                    y.checked_add_signed(*j).filter(|&y| y < ny),
                    z.checked_add_signed(*k).filter(|&z| z < nz),
                );
                let (Some(x), Some(y), Some(z)) = to else { continue };
                let label = labels[x + nx * (y + ny * z)];
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

/// Mean grey values of a phase in blocks, interpolated between their centres.
struct LocalMeans {
    shape: [usize; 3],
    blocks: [usize; 3],
    means: Vec<f64>,
}

impl LocalMeans {
    fn of(shape: [usize; 3], grey: &[u16], core: &[u8]) -> LocalMeans {
        let blocks = shape.map(|side| (side / BLOCK).max(1));
        let [nx, ny, _] = shape;
        let count = blocks.iter().product();
        let sums = (0..shape[2])
            .into_par_iter()
            .fold(
                || vec![(0_u64, 0_u64); count],
                |mut sums, z| {
                    let block = |n: usize, axis: usize| n * blocks[axis] / shape[axis];
                    for n in (0..nx * ny).filter(|&n| core[n + nx * ny * z] != 0) {
                        let [i, j, k] = [block(n % nx, 0), block(n / nx, 1), block(z, 2)];
                        let sum = &mut sums[i + blocks[0] * (j + blocks[1] * k)];
                        *sum = (sum.0 + 1, sum.1 + u64::from(grey[n + nx * ny * z]));
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
        let all = sums.iter().fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        let global = all.1 as f64 / all.0 as f64;
        let mean =
            |&(count, sum): &(u64, u64)| (sum as f64 + ENOUGH * global) / (count as f64 + ENOUGH);
        LocalMeans { shape, blocks, means: sums.iter().map(mean).collect() }
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
            self.means[i + self.blocks[0] * (j + self.blocks[1] * k)]
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
