//! Quality measures of a segmentation besides panoptic quality: median volume, and the fraction of true grain voxels
//! that are assigned to the correct grain.

use std::collections::HashMap;

/// Returns the median of the volumes; NaN without volumes.
pub(crate) fn median(volumes: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = volumes.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n == 0 { f64::NAN } else { 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]) }
}

/// Fractions of the true grain voxels, classified by the result of the segmentation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Assigned {
    /// Fraction assigned to the segmented grain that matches the true grain (intersection over union above one half).
    pub(crate) right: f64,
    /// Fraction assigned to no segmented grain.
    pub(crate) missing: f64,
    /// Fraction in true grains below the minimum size.
    pub(crate) small: f64,
}

/// Compares labels voxel by voxel; true grains of fewer than `least` voxels count as small.
pub(crate) fn assigned(truth: &[u32], found: &[u32], least: u64) -> Assigned {
    let mut pairs = HashMap::new();
    for pair in truth.iter().zip(found) {
        *pairs.entry((*pair.0, *pair.1)).or_insert(0_u64) += 1;
    }
    let (mut sizes, mut found_sizes) = (HashMap::new(), HashMap::new());
    for (&(a, b), &count) in &pairs {
        *sizes.entry(a).or_insert(0_u64) += count;
        *found_sizes.entry(b).or_insert(0_u64) += count;
    }
    let grains = |(label, _): &(&u32, &u64)| **label != 0;
    let all: u64 = sizes.iter().filter(grains).map(|(_, &size)| size).sum();
    let (mut right, mut missing) = (0, 0);
    for (&(a, b), &count) in pairs.iter().filter(|((a, _), _)| *a != 0) {
        if b == 0 {
            missing += count;
        } else if 2 * count > sizes[&a] + found_sizes[&b] - count {
            right += count;
        }
    }
    let below = |entry: &(&u32, &u64)| grains(entry) && *entry.1 < least;
    let small: u64 = sizes.iter().filter(below).map(|(_, &size)| size).sum();
    let share = |part: u64| part as f64 / all as f64;
    Assigned { right: share(right), missing: share(missing), small: share(small) }
}
