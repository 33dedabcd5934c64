//! Filters over 3³ neighbourhoods, on integers. Positions beyond the edge of the volume have the value of the nearest
//! voxel.

use std::ops::Range;

use rayon::prelude::*;

/// Returns, for each voxel, the median of the 27 values in its 3³ neighbourhood.
///
/// The nine voxels with the same x are sorted once and used by the three neighbourhoods that contain them. After the
/// sort, only 13 of the 27 voxels can be the median of the neighbourhood, and the median of these 13 voxels is the
/// median of the 27 voxels.
pub(crate) fn median(shape: [usize; 3], values: &[u16]) -> Vec<u16> {
    let mut result = vec![0; values.len()];
    medians(shape, values, &mut result, |_, _| std::iter::once(0..shape[0]));
    result
}

/// Computes the same median as [`median`], but only at the voxels of a set; `result` is not changed at other voxels.
pub(crate) fn median_again(shape: [usize; 3], values: &[u16], set: &[u8], result: &mut [u16]) {
    let [nx, ny, _] = shape;
    medians(shape, values, result, |y, z| runs(&set[nx * (y + ny * z)..][..nx]));
}

/// Computes the medians of all voxels in the parts of rows that `parts` returns for each y and z.
fn medians<Parts: Iterator<Item = Range<usize>>>(
    [nx, ny, nz]: [usize; 3],
    values: &[u16],
    result: &mut [u16],
    parts: impl Fn(usize, usize) -> Parts + Sync,
) {
    result.par_chunks_mut(nx * ny).enumerate().for_each_init(
        || Rows::new(nx),
        |rows, (z, slice)| {
            for (y, row) in slice.chunks_exact_mut(nx).enumerate() {
                for part in parts(y, z) {
                    rows.resize(part.len());
                    for (n, column) in rows.columns.iter_mut().enumerate() {
                        let y = (y + n % 3).saturating_sub(1).min(ny - 1);
                        let z = (z + n / 3).saturating_sub(1).min(nz - 1);
                        pad(column, &values[nx * (y + ny * z)..][..nx], part.clone());
                    }
                    rows.median(&mut row[part]);
                }
            }
        },
    );
}

/// Iterates over the runs of voxels in a row that belong to a set.
fn runs(row: &[u8]) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    std::iter::from_fn(move || {
        let start = end + row[end..].iter().position(|&voxel| voxel != 0)?;
        let length = row[start..].iter().position(|&voxel| voxel == 0);
        end = length.map_or(row.len(), |length| start + length);
        Some(start..end)
    })
}

/// Copies a part of a row, with one voxel before and one voxel after the part. The values are converted to signed
/// integers without changing their order, because processors compare signed 16-bit integers faster.
fn pad(column: &mut [i16], row: &[u16], part: Range<usize>) {
    let signed = |value: u16| (value ^ 0x8000) as i16;
    let n = part.len();
    column[0] = signed(row[part.start.saturating_sub(1)]);
    column[n + 1] = signed(row[part.end.min(row.len() - 1)]);
    column[1..=n].iter_mut().zip(&row[part]).for_each(|(to, &from)| *to = signed(from));
}

/// Work memory of the median filter for one part of a row.
struct Rows {
    /// `columns[i][x]`, for i from 0 to 8: the nine values of a 3³ neighbourhood that have the same x. x runs over the
    /// part and over one voxel before and after the part.
    columns: Vec<Vec<i16>>,
    /// For each rank in the sorted columns of nine values: the lowest, the middle and the highest of the values of
    /// three neighbouring columns along x.
    triples: [Vec<Vec<i16>>; 3],
}

impl Rows {
    fn new(nx: usize) -> Self {
        let rows = |length| vec![vec![0; length]; 9];
        Rows { columns: rows(nx + 2), triples: [rows(nx), rows(nx), rows(nx)] }
    }

    /// Resizes the work memory for a part of `voxels` voxels.
    fn resize(&mut self, voxels: usize) {
        self.columns.iter_mut().for_each(|column| column.resize(voxels + 2, 0));
        self.triples.iter_mut().flatten().for_each(|row| row.resize(voxels, 0));
    }

    fn median(&mut self, row: &mut [u16]) {
        for i in 1..9 {
            for j in (0..i).rev() {
                let (low, high) = self.columns.split_at_mut(j + 1);
                order(&mut low[j], &mut high[0]);
            }
        }
        let n = row.len();
        let [lows, mids, highs] = &mut self.triples;
        for (rank, column) in self.columns.iter().enumerate() {
            let (low, mid, high) = (&mut lows[rank], &mut mids[rank], &mut highs[rank]);
            low.copy_from_slice(&column[..n]);
            mid.copy_from_slice(&column[1..=n]);
            high.copy_from_slice(&column[2..]);
            order(low, mid);
            order(mid, high);
            order(low, mid);
        }
        // each step removes the largest and the smallest of some values, one above and one below the median, so that
        // the median does not change
        let mut left: Vec<&mut Vec<i16>> = Vec::with_capacity(13);
        left.extend(&mut lows[5..9]);
        left.extend(&mut mids[2..7]);
        left.extend(&mut highs[0..4]);
        let mut rest = left.split_off(8);
        while left.len() > 1 {
            let last = left.len() - 1;
            for j in 0..last {
                let (low, high) = left.split_at_mut(j + 1);
                order(low[j], high[0]);
            }
            left.truncate(last);
            for j in (1..left.len()).rev() {
                let (low, high) = left.split_at_mut(j);
                order(low[j - 1], high[0]);
            }
            left.remove(0);
            left.extend(rest.pop());
        }
        row.iter_mut().zip(left[0].iter()).for_each(|(to, &from)| *to = from as u16 ^ 0x8000);
    }
}

/// Puts the lower of each pair of values into `a` and the higher into `b`.
fn order(a: &mut [i16], b: &mut [i16]) {
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = ((*a).min(*b), (*a).max(*b));
    }
}

/// Smooths a volume with the weights 1–2–1 along each axis. The sum is rounded only once, so that the result does not
/// depend on the order of the axes.
pub(crate) fn binomial(shape: [usize; 3], values: &[u16]) -> Vec<u16> {
    let [nx, ny, nz] = shape;
    let mut result = vec![0; values.len()];
    result.par_chunks_mut(nx * ny).enumerate().for_each_init(
        || (vec![0_u32; nx * ny], vec![0_u32; nx]),
        |(sums, line), (z, out)| {
            let slice = |z: usize| &values[nx * ny * z..][..nx * ny];
            let (below, here, above) =
                (slice(z.saturating_sub(1)), slice(z), slice((z + 1).min(nz - 1)));
            for (n, sum) in sums.iter_mut().enumerate() {
                *sum = u32::from(below[n]) + 2 * u32::from(here[n]) + u32::from(above[n]);
            }
            for (y, out) in out.chunks_exact_mut(nx).enumerate() {
                let row = |y: usize| &sums[nx * y..][..nx];
                let (a, b, c) = (row(y.saturating_sub(1)), row(y), row((y + 1).min(ny - 1)));
                for (n, sum) in line.iter_mut().enumerate() {
                    *sum = a[n] + 2 * b[n] + c[n];
                }
                for (x, out) in out.iter_mut().enumerate() {
                    let (a, c) = (line[x.saturating_sub(1)], line[(x + 1).min(nx - 1)]);
                    *out = ((a + 2 * line[x] + c + 32) >> 6) as u16;
                }
            }
        },
    );
    result
}

/// Smooths like [`binomial`] at the voxels of a set; the result is 0 at all other voxels.
pub(crate) fn binomial_at(shape: [usize; 3], values: &[u16], set: &[u8]) -> Vec<u16> {
    let [nx, ny, nz] = shape;
    let mut result = vec![0; values.len()];
    let slices = result.par_chunks_mut(nx * ny).zip(set.par_chunks(nx * ny));
    slices.enumerate().for_each_init(
        || vec![0_u32; nx + 2],
        |line, (z, (out, set))| {
            let near_z = [z.saturating_sub(1), z, (z + 1).min(nz - 1)];
            for (y, (out, set)) in out.chunks_exact_mut(nx).zip(set.chunks_exact(nx)).enumerate() {
                let near_y = [y.saturating_sub(1), y, (y + 1).min(ny - 1)];
                for run in runs(set) {
                    let (from, to) = (run.start.saturating_sub(1), (run.end + 1).min(nx));
                    let line = &mut line[..to - from];
                    line.fill(0);
                    for (j, k) in (0..9).map(|n| (n % 3, n / 3)) {
                        let weight = [1, 2, 1][j] * [1, 2, 1][k];
                        let row = &values[nx * (near_y[j] + ny * near_z[k])..][from..to];
                        line.iter_mut()
                            .zip(row)
                            .for_each(|(sum, &value)| *sum += weight * u32::from(value));
                    }
                    for x in run {
                        let [a, b, c] =
                            [x.saturating_sub(1), x, (x + 1).min(nx - 1)].map(|x| line[x - from]);
                        out[x] = ((a + 2 * b + c + 32) >> 6) as u16;
                    }
                }
            }
        },
    );
    result
}

/// Erodes a set by one voxel: keeps the voxels whose whole 3³ neighbourhood is in the set.
pub(crate) fn erode(shape: [usize; 3], set: &[u8]) -> Vec<u8> {
    combine::<1, _>(shape, set, u8::min)
}

/// Erodes a set by two voxels: keeps the voxels whose whole 5³ neighbourhood is in the set.
pub(crate) fn core(shape: [usize; 3], set: &[u8]) -> Vec<u8> {
    combine::<2, _>(shape, set, u8::min)
}

/// Dilates a set by one voxel: adds the voxels that have a voxel of the set in their 3³ neighbourhood.
pub(crate) fn dilate(shape: [usize; 3], set: &[u8]) -> Vec<u8> {
    combine::<1, _>(shape, set, u8::max)
}

/// Computes the maximum of the 27 values around each voxel.
pub(crate) fn highest(shape: [usize; 3], values: &[u16]) -> Vec<u16> {
    combine::<1, _>(shape, values, u16::max)
}

/// Computes the minimum or the maximum (selected by `pick`) of all values up to `REACH` voxels away along each axis.
fn combine<const REACH: usize, T: Copy + Default + Send + Sync>(
    shape: [usize; 3],
    values: &[T],
    pick: impl Fn(T, T) -> T + Sync,
) -> Vec<T> {
    let [nx, ny, nz] = shape;
    let mut result = vec![T::default(); values.len()];
    // returns the indices of the lines that are at most `REACH` lines away from line `at`, without `at`; `count` is the
    // number of lines
    let around = |at: usize, count: usize| {
        (at.saturating_sub(REACH)..(at + REACH + 1).min(count)).filter(move |&near| near != at)
    };
    result.par_chunks_mut(nx * ny).enumerate().for_each_init(
        || (vec![T::default(); nx * ny], vec![T::default(); nx + 2 * REACH]),
        |(picked, line), (z, out)| {
            let slice = |z: usize| &values[nx * ny * z..][..nx * ny];
            picked.copy_from_slice(slice(z));
            for z in around(z, nz) {
                picked.iter_mut().zip(slice(z)).for_each(|(to, &from)| *to = pick(*to, from));
            }
            for (y, out) in out.chunks_exact_mut(nx).enumerate() {
                let row = |y: usize| &picked[nx * y..][..nx];
                let middle = &mut line[REACH..REACH + nx];
                middle.copy_from_slice(row(y));
                for y in around(y, ny) {
                    middle.iter_mut().zip(row(y)).for_each(|(to, &from)| *to = pick(*to, from));
                }
                let [first, last] = [line[REACH], line[REACH + nx - 1]];
                line[..REACH].fill(first);
                line[REACH + nx..].fill(last);
                out.copy_from_slice(&line[..nx]);
                for shift in 1..=2 * REACH {
                    let shifted = &line[shift..shift + nx];
                    out.iter_mut().zip(shifted).for_each(|(to, &from)| *to = pick(*to, from));
                }
            }
        },
    );
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::voxel_at;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn around(shape: [usize; 3], at: usize) -> Vec<(usize, u64)> {
        let voxel = voxel_at(shape, at);
        let all = (0..27).map(|n| [n % 3, n / 3 % 3, n / 9]);
        all.map(|step: [usize; 3]| {
            let to = [0, 1, 2]
                .map(|axis| (voxel[axis] + step[axis]).saturating_sub(1).min(shape[axis] - 1));
            let weight = step.iter().map(|&step| if step == 1 { 2 } else { 1 }).product();
            (to[0] + shape[0] * (to[1] + shape[1] * to[2]), weight)
        })
        .collect()
    }

    #[test]
    fn filters_agree_with_their_definitions() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        for shape in [[7, 5, 6], [1, 4, 3], [17, 1, 2], [33, 3, 3]] {
            let count = shape.iter().product();
            // values up to 3, so that equal values are frequent, and values over the whole range
            for most in [3, u16::MAX] {
                let values: Vec<u16> = (0..count).map(|_| rng.random_range(0..=most)).collect();
                let (medians, smooth) = (median(shape, &values), binomial(shape, &values));
                let set: Vec<u8> = values.iter().map(|&value| u8::from(value > most / 4)).collect();
                let (eroded, raised) = (erode(shape, &set), highest(shape, &values));
                let dilated = dilate(shape, &set);
                assert_eq!(core(shape, &set), erode(shape, &eroded));
                let mut again = vec![7; count];
                median_again(shape, &values, &set, &mut again);
                let smooth_at = binomial_at(shape, &values, &set);
                for at in 0..count {
                    let near = around(shape, at);
                    let mut sorted: Vec<u16> = near.iter().map(|&(n, _)| values[n]).collect();
                    sorted.sort_unstable();
                    assert_eq!(raised[at], sorted[26]);
                    assert_eq!(medians[at], sorted[13], "{shape:?}, voxel {at}");
                    let is_in_set = set[at] == 1;
                    assert_eq!(again[at], if is_in_set { sorted[13] } else { 7 });
                    assert_eq!(smooth_at[at], if is_in_set { smooth[at] } else { 0 });
                    let sum: u64 = near.iter().map(|&(n, w)| w * u64::from(values[n])).sum();
                    assert_eq!(u64::from(smooth[at]), (sum + 32) / 64);
                    assert_eq!(eroded[at] == 1, near.iter().all(|&(n, _)| set[n] == 1));
                    assert_eq!(dilated[at] == 1, near.iter().any(|&(n, _)| set[n] == 1));
                }
            }
        }
    }
}
