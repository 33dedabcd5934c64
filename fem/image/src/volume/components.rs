//! Filling of holes in a set of voxels, by connected components.

use super::disjoint_sets::DisjointSets;

/// A run of voxels along x: first index, and last index + 1.
type Run = (u32, u32);

/// Adds to `set` every hole of at most `most` voxels: a face-connected component of voxels outside the set that does
/// not reach the edge of the volume.
pub(crate) fn fill_holes(shape: [usize; 3], set: &mut [u8], most: usize) {
    if most == 0 {
        return;
    }
    let [nx, ny, nz] = shape;
    let rows = ny * nz;
    let mut runs: Vec<Run> = Vec::new();
    let mut first_of_row = Vec::with_capacity(rows + 1);
    for row in 0..rows {
        first_of_row.push(runs.len());
        let voxels = &set[nx * row..][..nx];
        let mut x = 0;
        while x < nx {
            let from = x;
            let inside = voxels[x] != 0;
            while x < nx && (voxels[x] != 0) == inside {
                x += 1;
            }
            if !inside {
                runs.push((from as u32, x as u32));
            }
        }
    }
    first_of_row.push(runs.len());
    let of_row = |row: usize| first_of_row[row]..first_of_row[row + 1];

    let mut sets = DisjointSets::new(runs.len());
    for row in 0..rows {
        let (y, z) = (row % ny, row / ny);
        let before = [(y > 0).then(|| row - 1), (z > 0).then(|| row - ny)];
        for other in before.into_iter().flatten() {
            let (mut a, mut b) = (of_row(row).start, of_row(other).start);
            while a < of_row(row).end && b < of_row(other).end {
                if runs[a].0 < runs[b].1 && runs[b].0 < runs[a].1 {
                    sets.join(a as u32, b as u32);
                }
                if runs[a].1 < runs[b].1 { a += 1 } else { b += 1 }
            }
        }
    }

    // number of voxels of each component; `usize::MAX` marks a component that reaches the edge of the volume
    let mut size = vec![0_usize; runs.len()];
    for row in 0..rows {
        let (y, z) = (row % ny, row / ny);
        let edge = y == 0 || z == 0 || y + 1 == ny || z + 1 == nz;
        for run in of_row(row) {
            let (from, to) = (runs[run].0 as usize, runs[run].1 as usize);
            let length = if edge || from == 0 || to == nx { usize::MAX } else { to - from };
            let root = sets.root(run as u32) as usize;
            size[root] = size[root].saturating_add(length);
        }
    }
    for row in 0..rows {
        for run in of_row(row) {
            if size[sets.root(run as u32) as usize] <= most {
                let (from, to) = (runs[run].0 as usize, runs[run].1 as usize);
                set[nx * row..][from..to].fill(1);
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
