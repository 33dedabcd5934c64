//! Connected parts of voxels with equal values.

use crate::volume::components::Components;

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
    let mut components = Components::of(shape, values, |value| (value != 0).then_some(value));
    let mut first_of_value = std::collections::BTreeMap::new();
    for (n, run) in components.runs.iter().enumerate().filter(|(_, run)| is_one(run.class)) {
        let first = *first_of_value.entry(run.class).or_insert(n as u32);
        components.sets.join(first, n as u32);
    }

    let mut numbers = vec![0_u32; values.len()];
    let (mut of_root, mut part_values) = (vec![0_u32; components.runs.len()], Vec::new());
    for row in 0..ny * nz {
        for n in components.of_row(row) {
            let root = components.sets.root(n as u32) as usize;
            let run = &components.runs[n];
            if of_root[root] == 0 {
                part_values.push(run.class);
                of_root[root] = part_values.len() as u32;
            }
            numbers[nx * row..][run.from as usize..run.to as usize].fill(of_root[root]);
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
