//! Detection of jumps of grey values between neighbouring slices: foreign slices, repeated slices, changes of the grey
//! scale, missing slices.
//!
//! Grey values also jump at the end of a specimen, but there all following slices differ from the slices before the
//! jump. A foreign slice differs from both of its neighbours, whereas its two neighbours are similar. After a change of
//! the grey scale, and where slices are missing, the specimen continues: the slices before and after the jump resemble
//! their other neighbours.

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
/// Slices may be missing between two slices if the difference of the two slices exceeds this multiple of three values:
/// the usual difference of neighbouring slices, and the differences at the previous and at the next pair of slices.
const MISSING: f64 = 1.4;
/// Slices are missing only if the mean of the grey values hardly changes, because the mean changes where another body
/// begins. This is the largest change, in standard deviations of the grey values of a slice.
const SAME_BODY: f64 = 0.08;
/// A change of the grey scale leaves a residual of the linear regression of at most this multiple of the residuals at
/// the neighbouring pairs of slices.
const EXPLAINED: f64 = 1.25;
/// Smallest number of groups of equal slices from which the number of copies of each slice is computed.
const LEAST_GROUPS: usize = 4;
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
    fn of(slice: &[f32], next: &[f32], after_next: Option<&[f32]>, compared: &[usize]) -> Self {
        let picked = |slice: &'_ [f32]| -> Vec<f64> {
            compared.iter().map(|&at| f64::from(slice[at])).collect()
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
    let slice = |k: usize| &volume.values[k * area..(k + 1) * area];
    let compared = varying(volume);
    if compared.is_empty() {
        return Vec::new();
    }
    let pairs: Vec<Pair> = (0..depth - 1)
        .into_par_iter()
        .map(|k| Pair::of(slice(k), slice(k + 1), (k + 2 < depth).then(|| slice(k + 2)), &compared))
        .collect();
    if let Some(warning) = copied(&pairs) {
        return vec![warning];
    }
    [foreign(&pairs), repeated(&pairs), rescaled(&pairs), interrupted(&pairs)]
        .into_iter()
        .flatten()
        .collect()
}

/// Returns the positions within a slice at which slices are compared: at most [`SAMPLE`] positions, without positions
/// whose grey value is the same in all slices. Such positions, for example a frame outside the field of view, would
/// increase the correlation of slices that have nothing else in common.
fn varying(volume: &Volume<f32>) -> Vec<usize> {
    let [width, height, _] = volume.shape;
    let area = width * height;
    let picked: Vec<usize> = (0..area).step_by(stride(area, width)).collect();
    let first = &volume.values[..area];
    let differs =
        |slice: &[f32]| -> Vec<bool> { picked.iter().map(|&at| slice[at] != first[at]).collect() };
    let either = |mut a: Vec<bool>, b: Vec<bool>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
        a
    };
    let slices = volume.values.par_chunks_exact(area);
    let varies = slices.map(differs).reduce(|| vec![false; picked.len()], either);
    picked.into_iter().zip(varies).filter(|(_, varies)| *varies).map(|(at, _)| at).collect()
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

/// Returns whether a slice and the next slice are identical and have more than one grey value.
fn is_same(pair: &Pair) -> bool {
    pair.next == 0.0 && pair.deviation > 0.0
}

/// Returns a warning if every slice is stored several times.
fn copied(pairs: &[Pair]) -> Option<String> {
    // sizes of the groups of identical slices; slices with a single grey value are not counted
    let mut groups = Vec::new();
    let mut size = 1;
    for pair in pairs.iter().filter(|pair| pair.deviation > 0.0) {
        match is_same(pair) {
            true => size += 1,
            false => groups.push(std::mem::replace(&mut size, 1)),
        }
    }
    groups.push(size);
    if groups.len() < LEAST_GROUPS {
        return None;
    }
    // the first and the last group may be incomplete
    let whole = &groups[1..groups.len() - 1];
    let copies = whole[0];
    (copies > 1 && whole.iter().all(|&size| size == copies)).then(|| {
        format!(
            "Heights are {copies} times too large and grains are elongated if slices are copies: every slice is stored \
             {copies} times; write each slice once."
        )
    })
}

fn repeated(pairs: &[Pair]) -> Option<String> {
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

/// Returns the numbers (from 0) of the pairs before and after pair `k`.
fn neighbours(pairs: &[Pair], k: usize) -> impl Iterator<Item = &Pair> {
    [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| pairs.get(k))
}

/// Returns whether the two slices of pair `k`, and the slices before and after them, show the same content.
fn continues(pairs: &[Pair], k: usize) -> bool {
    let is_alike = |pair: &Pair| pair.correlation > SAME_PICTURE;
    is_alike(&pairs[k]) && neighbours(pairs, k).all(is_alike)
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
        // where grains or the specimen begin, the difference of two slices is not a change of the grey scale, and the
        // residual of the regression is large
        let residual =
            neighbours(pairs, *k).map(|other| other.residual).fold(usual_residual, f64::max);
        let is_explained = pair.residual <= EXPLAINED * residual * pair.gain.max(1.0);
        // a jump is a change without similar changes next to it; where a grain begins, several consecutive slices
        // change
        let jumps = |change_of: &dyn Fn(&Pair) -> f64, least: f64, usual: f64| {
            let change = change_of(pair);
            let is_alone = neighbours(pairs, *k).all(|other| change_of(other) < ALONE * change);
            is_alone && change > least && change > UNUSUAL * usual
        };
        let is_unusual = jumps(&|pair| (pair.gain - gain).abs(), CHANGE, usual_gain)
            || jumps(&|pair| pair.level.abs(), CHANGE * pair.deviation, usual_level);
        continues(pairs, *k) && is_explained && is_unusual
    };
    let slices: Vec<usize> = (0..pairs.len()).filter(is_rescaled).collect();
    let jump = |k: &usize| {
        let Pair { gain: factor, level, .. } = pairs[*k];
        format!(
            "after slice {} grey values are multiplied by {:.3} and the mean moves by {level:.4}",
            k + 1,
            factor / gain
        )
    };
    let mut jumps: Vec<String> = slices.iter().take(LISTED).map(jump).collect();
    if slices.len() > LISTED {
        jumps.push(format!("{} others", slices.len() - LISTED));
    }
    (!jumps.is_empty()).then(|| {
        format!("Thresholds are wrong on one side if the grey scale changes: {}.", jumps.join("; "))
    })
}

/// Returns a warning about places at which slices may be missing or in the wrong order.
fn interrupted(pairs: &[Pair]) -> Option<String> {
    let alike = || pairs.iter().filter(|pair| pair.correlation > SAME_PICTURE);
    if alike().count() < LEAST_SLICES {
        return None;
    }
    let usual = median(alike().map(|pair| pair.next));
    // without noise, the difference of two slices is small where few grains begin or end
    if alike().any(|pair| pair.next < NOISY * usual) || usual <= 0.0 {
        return None;
    }
    let is_gap = |k: &usize| {
        let pair = &pairs[*k];
        let largest = neighbours(pairs, *k).map(|other| other.next).fold(usual, f64::max);
        let is_level = pair.level.abs() <= SAME_BODY * pair.deviation;
        pair.next > MISSING * largest && is_level && continues(pairs, *k)
    };
    let slices: Vec<usize> = (1..pairs.len() - 1).filter(is_gap).collect();
    let largest = slices.iter().map(|&k| pairs[k].next).fold(0.0, f64::max);
    (!slices.is_empty()).then(|| {
        format!(
            "Grains and heights are wrong if slices are missing or in the wrong order: after slice {} the image changes by up to \
             {:.1} times the usual difference of neighbouring slices.",
            listed(&slices),
            largest / usual
        )
    })
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

    /// Returns the image of `scan` without its ball and with many small balls.
    fn grains(seed: u64) -> Volume<f32> {
        let mut volume = scan(seed);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed + 100);
        let [side, _, depth] = volume.shape;
        let voxel = |n: usize| [n % side, n / side % side, n / (side * side)].map(|c| c as f64);
        for n in 0..side * side * depth {
            let [x, y, z] = voxel(n);
            if (x - 23.5).hypot(y - 23.5).hypot(z - 20.0) < 9.0 {
                volume.values[n] -= 20_000.0;
            }
        }
        let mut grain = vec![false; volume.values.len()];
        for _ in 0..300 {
            let centre = [
                rng.random_range(6.0..41.0),
                rng.random_range(6.0..41.0),
                rng.random_range(7.0..32.0),
            ];
            for (n, grain) in grain.iter_mut().enumerate() {
                let at = voxel(n);
                *grain |= (0..3).map(|k| (at[k] - centre[k]).powi(2)).sum::<f64>() < 6.25;
            }
        }
        for n in (0..grain.len()).filter(|&n| grain[n]) {
            let [x, y, _] = voxel(n);
            if (x - 23.5).hypot(y - 23.5) < 20.0 {
                volume.values[n] += 20_000.0;
            }
        }
        volume
    }

    #[test]
    fn a_valid_scan_causes_no_warning() {
        for seed in 0..5 {
            assert_eq!(doubts(&scan(seed)), Vec::<String>::new(), "{seed}");
            assert_eq!(doubts(&grains(seed)), Vec::<String>::new(), "{seed}");
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
        let area = shifted.shape[0] * shifted.shape[1];
        let stack = |volume: &Volume<f32>, order: &[usize]| {
            let values: Vec<f32> = order
                .iter()
                .flat_map(|k| &volume.values[k * area..(k + 1) * area])
                .copied()
                .collect();
            Volume::new([48, 48, order.len()], 0.02, values).unwrap()
        };
        let twice: Vec<usize> = (0..80).map(|k| k / 2).collect();
        let gap: Vec<usize> = (0..15).chain(22..40).collect();
        let reversed: Vec<usize> = (0..11).chain((11..18).rev()).chain(18..40).collect();
        let [twice, gap, reversed] = [twice, gap, reversed].map(|order| stack(&grains(1), &order));
        for (volume, parts) in [
            (twice, ["every slice is stored 2 times", "2 times too large"]),
            (gap, ["after slice 15 the image", "missing or in the wrong order"]),
            (reversed, ["after slice 11, 18 the image", "missing or in the wrong order"]),
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
