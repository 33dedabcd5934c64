//! Detection of jumps of grey values between neighbouring slices: foreign slices, repeated slices, changes of the grey
//! scale.
//!
//! Grey values also jump at the end of a specimen, but there all following slices differ from the slices before the
//! jump. A foreign slice differs from both of its neighbours, whereas its two neighbours are similar. After a change of
//! the grey scale, the slices still show the same content.

use rayon::prelude::*;

use crate::Volume;

/// Smallest number of slices from which the usual difference of neighbouring slices is computed.
const LEAST_SLICES: usize = 8;
/// Largest number of voxels of a slice that are compared with other slices.
const SAMPLE: usize = 1 << 16;
/// A slice counts as foreign if its difference from its neighbours exceeds this multiple of both: the difference
/// between its two neighbours, and the usual difference of neighbouring slices.
const FOREIGN: f64 = 3.0;
/// Repeated (equal) slices are reported only if the difference of all other pairs of neighbouring slices exceeds this
/// share of the usual difference.
const NOISY: f64 = 0.2;
/// Correlation above which two neighbouring slices show the same content.
const SAME_PICTURE: f64 = 0.8;
/// Smallest change of the grey scale that is reported: relative change of the contrast, or change of the mean in
/// standard deviations of the grey values of a slice.
const CHANGE: f64 = 0.05;
/// Smallest change of the grey scale that is reported, as a multiple of the usual change between neighbouring slices.
const UNUSUAL: f64 = 4.0;
/// A change between two slices counts as a jump only if the changes at the previous and at the next pair of slices are
/// below this share of the change.
const ALONE: f64 = 0.4;
/// Largest number of slices that a warning lists.
const LISTED: usize = 5;

/// Comparison of a slice with the next slice and with the slice after the next.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// Mean absolute difference of the grey values between this slice and the next slice.
    next: f64,
    /// Mean absolute difference of the grey values between this slice and the slice after the next; infinite for the
    /// last pair.
    after_next: f64,
    /// Standard deviation of the grey values of the slice.
    deviation: f64,
    /// Correlation of the grey values of this slice and the next slice.
    correlation: f64,
    /// Slope of the linear regression of the grey values of the next slice on the grey values of this slice.
    gain: f64,
    /// Mean of the next slice minus the mean of this slice.
    level: f64,
    /// Standard deviation of the residuals of the linear regression whose slope is `gain`.
    residual: f64,
}

impl Pair {
    fn of(slice: &[f32], next: &[f32], after_next: Option<&[f32]>, stride: usize) -> Self {
        let picked = |slice: &'_ [f32]| -> Vec<f64> {
            slice.iter().step_by(stride).copied().map(f64::from).collect()
        };
        let (a, b) = (picked(slice), picked(next));
        let n = a.len() as f64;
        let difference = |b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / n;
        let [mean_a, mean_b] = [&a, &b].map(|values| values.iter().sum::<f64>() / n);
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for (a, b) in a.iter().zip(&b) {
            let (a, b) = (a - mean_a, b - mean_b);
            (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
        }
        let gain = if aa > 0.0 { ab / aa } else { 1.0 };
        Pair {
            next: difference(&b),
            after_next: after_next.map_or(f64::INFINITY, |c| difference(&picked(c))),
            deviation: (aa / n).sqrt(),
            correlation: if aa * bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 },
            gain,
            level: mean_b - mean_a,
            residual: ((bb - gain * ab).max(0.0) / n).sqrt(),
        }
    }
}

/// Returns warnings about unusual sequences of slices, one sentence each.
pub(crate) fn doubts(volume: &Volume<f32>) -> Vec<String> {
    let [width, height, depth] = volume.shape;
    if depth < LEAST_SLICES {
        return Vec::new();
    }
    let area = width * height;
    let stride = stride(area, width);
    let slice = |k: usize| &volume.values[k * area..(k + 1) * area];
    let pairs: Vec<Pair> = (0..depth - 1)
        .into_par_iter()
        .map(|k| Pair::of(slice(k), slice(k + 1), (k + 2 < depth).then(|| slice(k + 2)), stride))
        .collect();
    [foreign(&pairs), repeated(&pairs), rescaled(&pairs)].into_iter().flatten().collect()
}

/// Returns the smallest stride that selects at most [`SAMPLE`] voxels and is coprime to the width, so that voxels of
/// all columns are selected.
fn stride(area: usize, width: usize) -> usize {
    fn divisor(a: usize, b: usize) -> usize {
        if b == 0 { a } else { divisor(b, a % b) }
    }
    let least = area.div_ceil(SAMPLE);
    (least..).find(|&stride| divisor(stride, width) == 1).unwrap_or(1)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn listed(slices: &[usize]) -> String {
    let mut text: Vec<String> = slices.iter().take(LISTED).map(|k| (k + 1).to_string()).collect();
    if slices.len() > LISTED {
        text.push(format!("{} others", slices.len() - LISTED));
    }
    text.join(", ")
}

fn foreign(pairs: &[Pair]) -> Option<String> {
    let usual = median(pairs.iter().map(|pair| pair.next));
    let is_foreign = |k: &usize| {
        let least = pairs[k - 1].next.min(pairs[*k].next);
        least > FOREIGN * usual.max(pairs[k - 1].after_next)
    };
    let slices: Vec<usize> = (1..pairs.len()).filter(is_foreign).filter(|_| usual > 0.0).collect();
    (!slices.is_empty()).then(|| {
        format!(
            "Grains are wrong near slices of another image: slice {} differs from both neighbours, which are alike.",
            listed(&slices)
        )
    })
}

fn repeated(pairs: &[Pair]) -> Option<String> {
    let is_same = |pair: &Pair| pair.next == 0.0 && pair.deviation > 0.0;
    let slices: Vec<usize> = (0..pairs.len()).filter(|&k| is_same(&pairs[k])).collect();
    let usual = median(pairs.iter().map(|pair| pair.next));
    let is_noisy = |pair: &Pair| is_same(pair) || pair.next > NOISY * usual;
    let is_rare = slices.len() <= 1 + pairs.len() / 50;
    (!slices.is_empty() && is_rare && usual > 0.0 && pairs.iter().all(is_noisy)).then(|| {
        format!(
            "Heights and grains are wrong if slices are copies: slice {} is identical to the next slice.",
            listed(&slices)
        )
    })
}

fn rescaled(pairs: &[Pair]) -> Option<String> {
    // use only slices with correlated content: slices of air do not show a change of the grey scale
    let alike: Vec<&Pair> = pairs.iter().filter(|pair| pair.correlation > SAME_PICTURE).collect();
    if alike.is_empty() {
        return None;
    }
    let gain = median(alike.iter().map(|pair| pair.gain));
    let usual_gain = median(alike.iter().map(|pair| (pair.gain - gain).abs()));
    let usual_level = median(alike.iter().map(|pair| pair.level.abs()));
    let usual_residual = median(alike.iter().map(|pair| pair.residual));
    let is_rescaled = |k: &usize| {
        let pair = &pairs[*k];
        let neighbours =
            || [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| pairs.get(k));
        // where grains or the specimen begin, the difference of two slices is not a change of the grey scale, and the
        // residual of the regression is large
        let residual = neighbours().map(|other| other.residual).fold(usual_residual, f64::max);
        let is_explained = pair.residual <= 1.5 * residual * pair.gain.max(1.0);
        // a jump is a change without similar changes next to it; where a grain begins, several consecutive slices
        // change
        let jumps = |change_of: &dyn Fn(&Pair) -> f64, least: f64, usual: f64| {
            let change = change_of(pair);
            let is_alone = neighbours().all(|other| change_of(other) < ALONE * change);
            is_alone && change > least && change > UNUSUAL * usual
        };
        let is_unusual = jumps(&|pair| (pair.gain - gain).abs(), CHANGE, usual_gain)
            || jumps(&|pair| pair.level.abs(), CHANGE * pair.deviation, usual_level);
        pair.correlation > SAME_PICTURE && is_explained && is_unusual
    };
    let slices: Vec<usize> = (0..pairs.len()).filter(is_rescaled).collect();
    let &first = slices.first()?;
    let pair = &pairs[first];
    Some(format!(
        "Thresholds are wrong on one side if the grey scale changes: after slice {} grey values are multiplied by {:.3} \
         and the mean moves by {:.4}.",
        listed(&slices),
        pair.gain / gain,
        pair.level
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Returns a noisy image of a cylinder with a ball, in air; the cylinder extends over slices 5 to 33 (from 0) of
    /// 40.
    fn scan(seed: u64) -> Volume<f32> {
        let (side, depth) = (48, 40);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut values = Vec::new();
        for n in 0..side * side * depth {
            let [x, y, z] = [n % side, n / side % side, n / (side * side)].map(|c| c as f64);
            let distance = (x - 23.5).hypot(y - 23.5);
            let inside = distance < 20.0 && (5.0..34.0).contains(&z);
            let ball = distance.hypot(z - 20.0) < 9.0;
            let grey = if ball {
                40_000.0
            } else if inside {
                20_000.0
            } else {
                2000.0
            };
            values.push((grey + rng.random_range(-2000.0..2000.0)) as f32);
        }
        Volume::new([side, side, depth], 0.02, values).unwrap()
    }

    fn slice(volume: &mut Volume<f32>, k: usize) -> &mut [f32] {
        let area = volume.shape[0] * volume.shape[1];
        &mut volume.values[k * area..(k + 1) * area]
    }

    #[test]
    fn a_valid_scan_causes_no_warning() {
        for seed in 0..5 {
            assert_eq!(doubts(&scan(seed)), Vec::<String>::new(), "{seed}");
        }
        // in a scan without noise, most neighbouring slices are identical
        let flat = scan(0);
        let round = |value: &f32| (value / 10_000.0).round();
        let values = flat.values.iter().map(round).collect();
        assert_eq!(doubts(&Volume::new(flat.shape, 0.02, values).unwrap()), Vec::<String>::new());
    }

    #[test]
    fn foreign_repeated_and_rescaled_slices_cause_warnings() {
        let mut blank = scan(1);
        slice(&mut blank, 16).fill(0.0);
        let mut other = scan(1);
        let stranger = slice(&mut scan(2), 2).to_vec();
        slice(&mut other, 24).copy_from_slice(&stranger);
        let mut copy = scan(1);
        let first = slice(&mut copy, 6).to_vec();
        slice(&mut copy, 7).copy_from_slice(&first);
        let mut brighter = scan(1);
        (20..40).for_each(|k| slice(&mut brighter, k).iter_mut().for_each(|value| *value *= 1.15));
        let mut shifted = scan(1);
        (13..40).for_each(|k| slice(&mut shifted, k).iter_mut().for_each(|value| *value += 3000.0));
        for (volume, parts) in [
            (blank, ["slice 17 differs", "both neighbours"]),
            (other, ["slice 25 differs", "both neighbours"]),
            (copy, ["slice 7 is identical", "next slice"]),
            (brighter, ["after slice 20 grey", "by 1.1"]),
            (shifted, ["after slice 13 grey", "moves by 3"]),
        ] {
            let warnings = doubts(&volume);
            assert_eq!(warnings.len(), 1, "{warnings:?}");
            assert!(parts.iter().all(|part| warnings[0].contains(part)), "{warnings:?}");
        }
    }
}
