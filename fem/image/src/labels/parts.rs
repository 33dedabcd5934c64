//! Connected parts of voxels with equal values.

use crate::volume::disjoint_sets::DisjointSets;

/// A run: consecutive voxels along x with the same value.
struct Run {
    value: u32,
    /// Index of the first voxel.
    from: usize,
    /// Index of the last voxel + 1.
    to: usize,
}

/// Numbers the face-connected parts of voxels with equal values from 1, in the order of the first voxels of the parts.
/// Voxels with the value 0 get the number 0. Returns the number of each voxel and the value of each part.
///
/// All voxels with a value for which `is_one` returns `true` form one part, even if the voxels are not connected.
pub(crate) fn numbered_parts(
    shape: [usize; 3],
    values: &[u32],
    is_one: impl Fn(u32) -> bool,
) -> (Vec<u32>, Vec<u32>) {
    let [nx, ny, nz] = shape;
    let mut runs: Vec<Run> = Vec::new();
    let mut first_of_row = Vec::with_capacity(ny * nz + 1);
    for row in values.chunks_exact(nx) {
        first_of_row.push(runs.len());
        let mut from = 0;
        for run in row.chunk_by(|a, b| a == b) {
            let to = from + run.len();
            if run[0] != 0 {
                runs.push(Run { value: run[0], from, to });
            }
            from = to;
        }
    }
    first_of_row.push(runs.len());
    let of_row = |row: usize| first_of_row[row]..first_of_row[row + 1];

    let mut sets = DisjointSets::new(runs.len());
    for row in 0..ny * nz {
        let (y, z) = (row % ny, row / ny);
        let before = [(y > 0).then(|| row - 1), (z > 0).then(|| row - ny)];
        for other in before.into_iter().flatten() {
            let (mut a, mut b) = (of_row(row).start, of_row(other).start);
            while a < of_row(row).end && b < of_row(other).end {
                let touch = runs[a].from < runs[b].to && runs[b].from < runs[a].to;
                if touch && runs[a].value == runs[b].value {
                    sets.join(a as u32, b as u32);
                }
                if runs[a].to < runs[b].to { a += 1 } else { b += 1 }
            }
        }
    }
    let mut first_of_value = std::collections::BTreeMap::new();
    for (n, run) in runs.iter().enumerate().filter(|(_, run)| is_one(run.value)) {
        sets.join(*first_of_value.entry(run.value).or_insert(n as u32), n as u32);
    }

    let mut numbers = vec![0_u32; values.len()];
    // the root of a set of runs is the run with the lowest index
    let (mut of_root, mut part_values) = (vec![0_u32; runs.len()], Vec::new());
    for row in 0..ny * nz {
        for n in of_row(row) {
            let root = sets.root(n as u32) as usize;
            if of_root[root] == 0 {
                part_values.push(runs[n].value);
                of_root[root] = part_values.len() as u32;
            }
            numbers[nx * row..][runs[n].from..runs[n].to].fill(of_root[root]);
        }
    }
    (numbers, part_values)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::volume::voxel_at;

    /// Numbers parts like [`numbered_parts`], by a flood fill from each voxel without a number.
    fn by_flood(shape: [usize; 3], values: &[u32], one: u32) -> (Vec<u32>, Vec<u32>) {
        let (mut numbers, mut parts) = (vec![0; values.len()], Vec::new());
        let mut number_of_one = 0;
        for start in 0..values.len() {
            if values[start] == 0 || numbers[start] != 0 {
                continue;
            }
            let number = match values[start] == one && number_of_one != 0 {
                true => number_of_one,
                false => {
                    parts.push(values[start]);
                    parts.len() as u32
                }
            };
            if values[start] == one {
                number_of_one = number;
            }
            let mut stack = vec![start];
            numbers[start] = number;
            while let Some(at) = stack.pop() {
                let voxel = voxel_at(shape, at);
                for (axis, step) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1_isize)] {
                    let mut to = voxel;
                    let moved = voxel[axis].checked_add_signed(step).filter(|&n| n < shape[axis]);
                    let Some(moved) = moved else { continue };
                    to[axis] = moved;
                    let next = to[0] + shape[0] * (to[1] + shape[1] * to[2]);
                    if values[next] == values[start] && numbers[next] == 0 {
                        numbers[next] = number;
                        stack.push(next);
                    }
                }
            }
        }
        (numbers, parts)
    }

    #[test]
    fn numbered_parts_agree_with_a_flood_fill() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        for (shape, most) in [([9, 8, 7], 1), ([9, 8, 7], 3), ([14, 3, 9], 2), ([1, 1, 30], 2)] {
            let count = shape.iter().product();
            let values: Vec<u32> = (0..count).map(|_| rng.random_range(0..=most)).collect();
            for one in [0, 2] {
                let numbered = numbered_parts(shape, &values, |value| value == one);
                assert_eq!(numbered, by_flood(shape, &values, one), "{shape:?}, {most}, {one}");
            }
        }
    }
}
