//! Grey values of all slices at a limited number of positions.

use rayon::prelude::*;

use crate::Volume;

/// Largest number of positions of a slice at which slices are compared.
const POSITIONS: usize = 1 << 14;

/// Grey values of slices at the same positions. Each value is the mean over 3² voxels with the weights 1–2–1, so that
/// noise has less effect.
pub(super) struct Samples {
    pub(super) slices: Vec<Vec<f32>>,
    /// For each slice except the last: share of the positions at which the unfiltered value differs from the value in
    /// the next slice.
    pub(super) changed: Vec<f64>,
}

impl Samples {
    /// Returns the samples of an image, or `None` if all slices are equal at all positions.
    ///
    /// Positions whose grey value is the same in all slices, for example a frame outside the field of view, are left
    /// out: they would increase the correlation of slices that have nothing else in common.
    pub(super) fn of(volume: &Volume<f32>) -> Option<Self> {
        let [width, height, depth] = volume.shape;
        let area = width * height;
        let slice = |k: usize| &volume.values[k * area..(k + 1) * area];
        let picked: Vec<usize> = (0..area).step_by(stride(area, width)).collect();
        let differing = |k: usize| -> Vec<bool> {
            picked.iter().map(|&at| slice(k)[at] != slice(k + 1)[at]).collect()
        };
        let differing: Vec<Vec<bool>> = (0..depth - 1).into_par_iter().map(differing).collect();
        let varies = |n: &usize| differing.iter().any(|differs| differs[*n]);
        let varying: Vec<usize> = (0..picked.len()).filter(varies).collect();
        if varying.is_empty() {
            return None;
        }
        let share = |differs: &Vec<bool>| {
            varying.iter().filter(|&&n| differs[n]).count() as f64 / varying.len() as f64
        };
        let changed = differing.iter().map(share).collect();
        let smooth = |k: usize| -> Vec<f32> {
            varying.iter().map(|&n| smoothed(slice(k), [width, height], picked[n])).collect()
        };
        Some(Samples { slices: (0..depth).into_par_iter().map(smooth).collect(), changed })
    }

    /// Returns the mean squared difference of two slices.
    pub(super) fn mean_square(&self, i: usize, j: usize) -> f64 {
        let (a, b) = (&self.slices[i], &self.slices[j]);
        a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / a.len() as f64
    }
}

/// Returns the mean over the 3² voxels around a voxel of a slice with the weights 1–2–1.
fn smoothed(slice: &[f32], [width, height]: [usize; 2], at: usize) -> f32 {
    let (x, y) = (at % width, at / width);
    let mut sum = 0.0;
    for (weight_y, y) in [(1.0, y.saturating_sub(1)), (2.0, y), (1.0, (y + 1).min(height - 1))] {
        let row = &slice[y * width..(y + 1) * width];
        let ends = row[x.saturating_sub(1)] + row[(x + 1).min(width - 1)];
        sum += weight_y * (ends + 2.0 * row[x]);
    }
    sum / 16.0
}

/// Returns the smallest stride that selects at most [`POSITIONS`] voxels and is coprime to the width, so that voxels of
/// all columns are selected.
fn stride(area: usize, width: usize) -> usize {
    fn divisor(a: usize, b: usize) -> usize {
        if b == 0 { a } else { divisor(b, a % b) }
    }
    let least = area.div_ceil(POSITIONS);
    (least..).find(|&stride| divisor(stride, width) == 1).unwrap_or(1)
}
