//! The grey level between matrix and grain.

use std::ops::Range;

use rayon::prelude::*;

use crate::Volume;
use crate::classify::threshold::{WIDTH, class_means, histogram, middle, otsu};
use crate::volume::filter::erode;

/// Fewer voxels away from interfaces than this do not make a mean.
const CORE: u64 = 1000;
/// Two halves of one bell curve are this many of their own deviations apart.
const ONE_BELL: f64 = 3.0;
/// The level lies between these shares of the way from matrix to grain.
const WAY: [f64; 2] = [0.3, 0.7];
/// Shares of grain are cut here before they are summed: noise passes, pores do not.
const CUT: [f64; 2] = [-0.5, 1.5];

/// A level that parts matrix from grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    pub(crate) value: f64,
    /// Whether the grey values look like those of one phase.
    pub(crate) one_bell: bool,
}

impl Level {
    /// Finds the level for an image that was filtered (`smooth`), so that as many voxels lie above it as
    /// the unfiltered grey values make up.
    ///
    /// Otsu's threshold comes first, then the middle between the means of matrix and grains away from
    /// interfaces. That leaves a plane interface in its place, but makes convex grains smaller where the
    /// image is blurred or filtered. So the grain shares of the voxels near grains, linear between the
    /// two means, are summed, and the level is moved to where the filtered image has that volume.
    ///
    /// `void` is the least grey value that is not air. Nothing if there is one grey value only.
    pub(crate) fn find(
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        inside: &[u8],
        void: f64,
    ) -> Option<Level> {
        let solid: Vec<u8> = smooth
            .values
            .par_iter()
            .zip(inside)
            .map(|(&value, &inside)| u8::from(f64::from(value) >= void) & inside)
            .collect();
        let counts = histogram(&smooth.values, &solid);
        let split = *otsu(&counts, 2)?.first()?;
        let mut level = Level {
            value: (split * WIDTH) as f64,
            one_bell: separation(&counts, split) < ONE_BELL,
        };
        let mut means = None;
        for _ in 0..2 {
            let matrix = core_mean(smooth, inside, void..level.value);
            let grain = core_mean(smooth, inside, level.value..f64::INFINITY);
            let (Some(matrix), Some(grain)) = (matrix, grain) else { break };
            level.value = (matrix + grain) / 2.0;
            means = Some([matrix, grain]);
        }
        if let Some([matrix, grain]) = means {
            let volume = volume(smooth, grey, inside, level.value, [matrix, grain]);
            let limit = |share: f64| matrix + share * (grain - matrix);
            level.value = level_of(&counts, volume).clamp(limit(WAY[0]), limit(WAY[1]));
        }
        Some(level)
    }
}

/// The grey level from on which there are so many voxels.
fn level_of(counts: &[u64], voxels: f64) -> f64 {
    let mut above = 0.0;
    for (bin, &count) in counts.iter().enumerate().rev() {
        let next = above + count as f64;
        if next >= voxels && count > 0 {
            let part = (voxels - above) / count as f64;
            return (bin as f64 + 1.0 - part) * WIDTH as f64;
        }
        above = next;
    }
    0.0
}

/// The sum of the grain shares (voxels).
fn volume(
    smooth: &Volume<u16>,
    grey: &Volume<u16>,
    inside: &[u8],
    level: f64,
    [matrix, grain]: [f64; 2],
) -> f64 {
    let shape = grey.shape;
    let set: Vec<u8> = smooth
        .values
        .par_iter()
        .zip(inside)
        .map(|(&value, &inside)| u8::from(f64::from(value) >= level) & inside)
        .collect();
    let rest: Vec<u8> = set.par_iter().map(|&grain| 1 - grain).collect();
    let twice = |set: &[u8]| erode(shape, &erode(shape, set));
    let (core, far) = (twice(&set), twice(&rest));
    // integers, so that the order of summation does not show
    let unit = 65536.0;
    let sum: i64 = (0..set.len())
        .into_par_iter()
        .filter(|&n| far[n] == 0 && inside[n] != 0)
        .map(|n| {
            let share = (f64::from(grey.values[n]) - matrix) / (grain - matrix);
            let share = if core[n] != 0 { 1.0 } else { share.clamp(CUT[0], CUT[1]) };
            (share * unit).round() as i64
        })
        .sum();
    sum as f64 / unit
}

/// The mean of the grey values in a range, of voxels whose neighbours up to two voxels away are in it too;
/// nothing if there are too few.
pub(crate) fn core_mean(image: &Volume<u16>, inside: &[u8], range: Range<f64>) -> Option<f64> {
    let values = image.values.par_iter().zip(inside);
    let class: Vec<u8> = values
        .map(|(&value, &inside)| u8::from(range.contains(&f64::from(value))) & inside)
        .collect();
    let core = erode(image.shape, &erode(image.shape, &class));
    let counts = histogram(&image.values, &core);
    (counts.iter().sum::<u64>() >= CORE).then(|| class_means(&counts, &[])[0])
}

/// Distance of the means of two classes over the mean of their standard deviations.
fn separation(counts: &[u64], split: usize) -> f64 {
    let moments = |counts: &[u64], first: usize| {
        let all: u64 = counts.iter().sum();
        let weighted = |value: &dyn Fn(f64) -> f64| {
            let values = counts.iter().enumerate();
            values.map(|(n, &c)| c as f64 * value(middle(first + n))).sum::<f64>() / all as f64
        };
        let mean = weighted(&|v| v);
        (mean, weighted(&|v| (v - mean).powi(2)).sqrt())
    };
    let (low, high) = (moments(&counts[..split], 0), moments(&counts[split..], split));
    (high.0 - low.0) / ((low.1 + high.1) / 2.0).max(f64::MIN_POSITIVE)
}
