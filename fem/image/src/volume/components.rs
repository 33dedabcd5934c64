//! Connected components of a set of voxels: the largest component, and filling of holes.

use std::ops::Range;

use super::disjoint_sets::DisjointSets;

/// A run of voxels along x: first index, and last index + 1.
type Run = (u32, u32);

/// Runs of the voxels of a set, and the face-connected components that they form.
struct Components {
    runs: Vec<Run>,
    /// Index of the first run of each row; one more entry for the end of the last row.
    first_of_row: Vec<usize>,
    sets: DisjointSets,
}

impl Components {
    /// Finds the components of the voxels for which `is_member` holds.
    fn of([nx, ny, nz]: [usize; 3], set: &[u8], is_member: impl Fn(u8) -> bool) -> Self {
        let rows = ny * nz;
        let mut runs: Vec<Run> = Vec::new();
        let mut first_of_row = Vec::with_capacity(rows + 1);
        for row in 0..rows {
            first_of_row.push(runs.len());
            let voxels = &set[nx * row..][..nx];
            let mut x = 0;
            while x < nx {
                let from = x;
                let member = is_member(voxels[x]);
                while x < nx && is_member(voxels[x]) == member {
                    x += 1;
                }
                if member {
                    runs.push((from as u32, x as u32));
                }
            }
        }
        first_of_row.push(runs.len());
        let sets = DisjointSets::new(runs.len());
        let mut components = Components { runs, first_of_row, sets };
        for row in 0..rows {
            let (y, z) = (row % ny, row / ny);
            let before = [(y > 0).then(|| row - 1), (z > 0).then(|| row - ny)];
            for other in before.into_iter().flatten() {
                components.join(row, other);
            }
        }
        components
    }

    fn of_row(&self, row: usize) -> Range<usize> {
        self.first_of_row[row]..self.first_of_row[row + 1]
    }

    /// Joins the overlapping runs of two neighbouring rows.
    fn join(&mut self, row: usize, other: usize) {
        let (here, there) = (self.of_row(row), self.of_row(other));
        let (mut a, mut b) = (here.start, there.start);
        while a < here.end && b < there.end {
            if self.runs[a].0 < self.runs[b].1 && self.runs[b].0 < self.runs[a].1 {
                self.sets.join(a as u32, b as u32);
            }
            if self.runs[a].1 < self.runs[b].1 { a += 1 } else { b += 1 }
        }
    }
}

/// Returns the number of voxels of the largest face-connected component of a set.
pub(crate) fn largest_component(shape: [usize; 3], set: &[u8]) -> usize {
    let mut components = Components::of(shape, set, |voxel| voxel != 0);
    let mut sizes = vec![0; components.runs.len()];
    for (run, &(from, to)) in components.runs.iter().enumerate() {
        sizes[components.sets.root(run as u32) as usize] += (to - from) as usize;
    }
    sizes.into_iter().max().unwrap_or(0)
}

/// Adds to `set` every hole of at most `most` voxels: a face-connected component of voxels outside the set that does
/// not reach the edge of the volume.
pub(crate) fn fill_holes(shape: [usize; 3], set: &mut [u8], most: usize) {
    if most == 0 {
        return;
    }
    let [nx, ny, nz] = shape;
    let rows = ny * nz;
    let mut components = Components::of(shape, set, |voxel| voxel == 0);

    // number of voxels of each component; `usize::MAX` marks a component that reaches the edge of the volume
    let mut size = vec![0_usize; components.runs.len()];
    for row in 0..rows {
        let (y, z) = (row % ny, row / ny);
        let edge = y == 0 || z == 0 || y + 1 == ny || z + 1 == nz;
        for run in components.of_row(row) {
            let (from, to) = components.runs[run];
            let (from, to) = (from as usize, to as usize);
            let length = if edge || from == 0 || to == nx { usize::MAX } else { to - from };
            let root = components.sets.root(run as u32) as usize;
            size[root] = size[root].saturating_add(length);
        }
    }
    for row in 0..rows {
        for run in components.of_row(row) {
            if size[components.sets.root(run as u32) as usize] <= most {
                let (from, to) = components.runs[run];
                set[nx * row..][from as usize..to as usize].fill(1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::voxel_at;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Fills holes like [`fill_holes`], by a flood fill from every voxel.
    fn by_flood(shape: [usize; 3], set: &[u8], most: usize) -> Vec<u8> {
        let mut result = set.to_vec();
        for start in (0..set.len()).filter(|&n| set[n] == 0) {
            let mut component = vec![start];
            let mut stack = vec![start];
            let mut edge = false;
            while let Some(at) = stack.pop() {
                let voxel = voxel_at(shape, at);
                for (axis, step) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1_isize)] {
                    let mut to = voxel;
                    match voxel[axis].checked_add_signed(step).filter(|&n| n < shape[axis]) {
                        Some(n) => to[axis] = n,
                        None => {
                            edge = true;
                            continue;
                        }
                    }
                    let next = to[0] + shape[0] * (to[1] + shape[1] * to[2]);
                    if set[next] == 0 && !component.contains(&next) {
                        component.push(next);
                        stack.push(next);
                    }
                }
            }
            if !edge && component.len() <= most {
                component.into_iter().for_each(|n| result[n] = 1);
            }
        }
        result
    }

    #[test]
    fn filled_holes_agree_with_a_flood_fill() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for (shape, share, most) in
            [([9, 8, 7], 0.75, 3), ([9, 8, 7], 0.7, 100), ([12, 3, 9], 0.8, 1), ([5, 5, 5], 0.8, 0)]
        {
            let count = shape.iter().product();
            let set: Vec<u8> = (0..count).map(|_| u8::from(rng.random_bool(share))).collect();
            let mut filled = set.clone();
            fill_holes(shape, &mut filled, most);
            assert_eq!(filled, by_flood(shape, &set, most), "{shape:?}, {most}");
        }
    }
}
