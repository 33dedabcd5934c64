//! Exact Euclidean distance to the nearest voxel outside a set.
//!
//! Squared distances between voxels are integers. Distances along x are computed by counting voxels. Then, for each
//! line along y and afterwards along z, the squared distance at position x of the line is the minimum over i of (x −
//! i)² + g(i), where g(i) is the squared distance of voxel i along the previous axes. This minimum is the lower
//! envelope of parabolas.
//!
//! Reference: A. Meijster, J. B. T. M. Roerdink, W. H. Hesselink, "A general algorithm for computing
//! distance transforms in linear time", Mathematical Morphology (2000) 331–340,
//! doi:10.1007/0-306-47025-X_36.

use rayon::prelude::*;

/// Placeholder for a distance as long as no voxel outside the set has been found.
const FAR: u32 = u32::MAX;
/// Number of neighbouring lines that are processed together, so that whole cache lines are used.
const BLOCK: usize = 16;

/// Returns the squared distance of each voxel from the nearest voxel outside the set, in voxels²; 0 outside the set,
/// and `u32::MAX` everywhere if the set contains all voxels. Positions beyond the edge of the volume do not count as
/// outside the set.
pub(crate) fn squared_distance(shape: [usize; 3], set: &[u8]) -> Vec<u32> {
    let [nx, ny, nz] = shape;
    let mut flat = vec![0_u32; set.len()];
    flat.par_chunks_mut(nx * ny).zip(set.par_chunks(nx * ny)).for_each_init(
        || Columns::new(ny),
        |columns, (slice, set)| {
            slice.chunks_exact_mut(nx).zip(set.chunks_exact(nx)).for_each(|(row, set)| {
                along_row(row, set);
            });
            for x in (0..nx).step_by(BLOCK) {
                let width = BLOCK.min(nx - x);
                columns.load(width, |n| &slice[nx * n + x..][..width]);
                columns.transform(width);
                columns.store(width, |n, c| slice[nx * n + x + c.0] = c.1);
            }
        },
    );
    // distances along z: `turned` is ordered y, z, x (x fastest), so that each thread writes to a contiguous part of
    // the memory
    let mut turned = vec![0_u32; set.len()];
    turned.par_chunks_mut(nx * nz).enumerate().for_each_init(
        || Columns::new(nz),
        |columns, (y, part)| {
            for x in (0..nx).step_by(BLOCK) {
                let width = BLOCK.min(nx - x);
                columns.load(width, |z| &flat[nx * (y + ny * z) + x..][..width]);
                columns.transform(width);
                columns.store(width, |z, c| part[nx * z + x + c.0] = c.1);
            }
        },
    );
    flat.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
        for (y, row) in slice.chunks_exact_mut(nx).enumerate() {
            row.copy_from_slice(&turned[nx * (z + nz * y)..][..nx]);
        }
    });
    flat
}

/// Computes the squared distances along a row: from each voxel to the nearest voxel of the row that is outside the set.
fn along_row(row: &mut [u32], set: &[u8]) {
    let mut steps = FAR;
    let mut step = |value: &mut u32, inside: u8| {
        steps = if inside == 0 { 0 } else { steps.saturating_add(1) };
        *value = steps.min(*value);
    };
    row.fill(FAR);
    row.iter_mut().zip(set).for_each(|(value, &inside)| step(value, inside));
    steps = FAR;
    let mut step = |value: &mut u32, inside: u8| {
        steps = if inside == 0 { 0 } else { steps.saturating_add(1) };
        *value = steps.min(*value);
    };
    row.iter_mut().zip(set).rev().for_each(|(value, &inside)| step(value, inside));
    for value in row {
        if *value != FAR {
            *value *= *value;
        }
    }
}

/// Work memory: several lines of values, and the parabolas of the lower envelope of one line.
struct Columns {
    length: usize,
    lines: Vec<u32>,
    result: Vec<u32>,
    /// For each parabola of the envelope: its centre i, and the position from which it is the lowest parabola.
    parabolas: Vec<(i64, i64)>,
}

impl Columns {
    fn new(length: usize) -> Self {
        let lines = vec![0; length * BLOCK];
        Columns { length, result: lines.clone(), lines, parabolas: Vec::with_capacity(length) }
    }

    fn load<'a>(&mut self, width: usize, row: impl Fn(usize) -> &'a [u32]) {
        for n in 0..self.length {
            for (c, &value) in row(n)[..width].iter().enumerate() {
                self.lines[c * self.length + n] = value;
            }
        }
    }

    fn store(&self, width: usize, mut put: impl FnMut(usize, (usize, u32))) {
        for n in 0..self.length {
            for c in 0..width {
                put(n, (c, self.result[c * self.length + n]));
            }
        }
    }

    fn transform(&mut self, width: usize) {
        let lines = self.lines.chunks_exact(self.length).take(width);
        for (line, result) in lines.zip(self.result.chunks_exact_mut(self.length)) {
            envelope(line, result, &mut self.parabolas);
        }
    }
}

/// Computes the squared distances of a line from the lower envelope of its parabolas.
fn envelope(line: &[u32], result: &mut [u32], parabolas: &mut Vec<(i64, i64)>) {
    if line.iter().all(|&g| g == 0) || line.iter().all(|&g| g == FAR) {
        result.copy_from_slice(line);
        return;
    }
    let g = |i: i64| i64::from(line[i as usize]);
    let height = |x: i64, i: i64| (x - i) * (x - i) + g(i);
    parabolas.clear();
    for q in (0..line.len() as i64).filter(|&q| line[q as usize] != FAR) {
        while parabolas.last().is_some_and(|&(i, start)| height(start, i) > height(start, q)) {
            parabolas.pop();
        }
        match parabolas.last() {
            None => parabolas.push((q, 0)),
            Some(&(i, _)) => {
                let start = 1 + (q * q - i * i + g(q) - g(i)).div_euclid(2 * (q - i));
                if start < line.len() as i64 {
                    parabolas.push((q, start));
                }
            }
        }
    }
    let mut end = line.len();
    for &(i, start) in parabolas.iter().rev() {
        let start = start as usize;
        for x in start..end {
            result[x] = height(x as i64, i) as u32;
        }
        end = start;
    }
}

/// Distances in 16-bit fixed-point representation.
#[derive(Clone, Debug)]
pub(crate) struct FixedDistance {
    pub(crate) values: Vec<u16>,
    /// Number of fixed-point units per voxel: 256, or fewer if distances exceed 255 voxels.
    pub(crate) per_voxel: u16,
}

/// Returns the square roots of squared distances, rounded to 1/256 voxel, or to a coarser unit if distances exceed 255
/// voxels.
pub(crate) fn fixed_point(squared: &[u32]) -> FixedDistance {
    let longest = f64::from(squared.par_iter().copied().max().unwrap_or(0)).sqrt();
    let mut per_voxel = 256_u16;
    while per_voxel > 1 && longest * f64::from(per_voxel) > 65535.0 {
        per_voxel /= 2;
    }
    let round = |&squared: &u32| (f64::from(squared).sqrt() * f64::from(per_voxel)).round() as u16;
    FixedDistance { values: squared.par_iter().map(round).collect(), per_voxel }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::voxel_at;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn distances_agree_with_an_exhaustive_search() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        for (shape, share) in
            [([9, 7, 8], 0.9), ([20, 3, 5], 0.97), ([1, 19, 17], 0.99), ([6, 6, 6], 0.3)]
        {
            let count: usize = shape.iter().product();
            let set: Vec<u8> = (0..count).map(|_| u8::from(rng.random_bool(share))).collect();
            let distances = squared_distance(shape, &set);
            let outside: Vec<[usize; 3]> =
                (0..count).filter(|&n| set[n] == 0).map(|n| voxel_at(shape, n)).collect();
            for at in 0..count {
                let here = voxel_at(shape, at);
                let squared = |other: &[usize; 3]| -> u32 {
                    (0..3).map(|axis| here[axis].abs_diff(other[axis]).pow(2) as u32).sum()
                };
                let nearest = outside.iter().map(squared).min().unwrap_or(FAR);
                assert_eq!(distances[at], nearest, "{shape:?}, voxel {here:?}");
            }
        }
    }

    #[test]
    fn distances_in_a_full_volume_are_infinite() {
        assert_eq!(squared_distance([3, 2, 2], &[1; 12]), vec![FAR; 12]);
    }

    #[test]
    fn long_distances_have_a_coarser_unit() {
        let fixed = fixed_point(&[0, 1, 2, 300 * 300]);
        assert_eq!((fixed.per_voxel, &fixed.values[..]), (128, &[0, 128, 181, 38400][..]));
        assert_eq!(fixed_point(&[2]).values, [362]);
    }
}
