//! Histograms of grey values, and thresholds that separate the classes of a histogram.

use std::ops::Range;

use rayon::prelude::*;

use crate::Volume;
use crate::volume::filter::{core, erode};
use crate::volume::grey::sum;

/// Number of bins of a histogram of 16-bit values.
pub(crate) const BINS: usize = 1024;
/// Number of grey values in a bin.
pub(crate) const WIDTH: usize = 65536 / BINS;

/// Smallest number of voxels away from interfaces from which the mean grey value of a class is computed.
const CORE: u64 = 1000;
/// Number of windows into which the range of grey values of a class is divided in the search for a peak.
const WINDOWS: usize = 12;
/// Smallest ratio of the number of voxels at a peak of a histogram to the numbers at both ends of the class.
const PEAK: f64 = 1.5;

/// Returns the grey value in the middle of a bin.
pub(crate) fn middle(bin: usize) -> f64 {
    bin as f64 * WIDTH as f64 + (WIDTH as f64 - 1.0) / 2.0
}

/// Returns the histogram of the values at the voxels of a set.
pub(crate) fn histogram(values: &[u16], set: &[u8]) -> Vec<u64> {
    let portion = 1 << 20;
    values
        .par_chunks(portion)
        .zip(set.par_chunks(portion))
        .fold(
            || vec![0; BINS],
            |mut counts, (values, set)| {
                for (&value, &inside) in values.iter().zip(set) {
                    counts[value as usize / WIDTH] += u64::from(inside);
                }
                counts
            },
        )
        .reduce(|| vec![0; BINS], sum)
}

/// Splits a histogram into classes with the largest variance between the classes (Otsu's method).
///
/// Returns the first bin of each class except the lowest; `None` if fewer bins than classes are occupied. If
/// empty bins lie between two classes, the threshold is in the middle of the empty bins.
///
/// # References N. Otsu, IEEE Trans. Syst. Man Cybern. 9 (1979) 62–66, doi:10.1109/TSMC.1979.4310076; several
/// thresholds by dynamic programming, which maximises the sum over the classes of (Σ n v)² / Σ n, where n is the number
/// of voxels of a bin and v its grey value.
pub(crate) fn otsu(counts: &[u64], classes: usize) -> Option<Vec<usize>> {
    let bins = counts.len();
    if classes < 2 || counts.iter().filter(|&&count| count > 0).count() < classes {
        return None;
    }
    let mut total = vec![(0_u64, 0_u64); bins + 1];
    for (bin, &count) in counts.iter().enumerate() {
        total[bin + 1] = (total[bin].0 + count, total[bin].1 + count * bin as u64);
    }
    // returns the gain (Σ n v)² / Σ n of a class that consists of the bins from..to; a class must not be empty
    let gain = |from: usize, to: usize| {
        let count = total[to].0 - total[from].0;
        let moment = (total[to].1 - total[from].1) as f64;
        if count == 0 { f64::NEG_INFINITY } else { moment * moment / count as f64 }
    };
    // best[to] is the largest sum of gains if the bins before `to` are divided into the current number of classes
    let mut best: Vec<f64> = (0..=bins).map(|to| gain(0, to)).collect();
    let mut splits: Vec<Vec<usize>> = Vec::new();
    for _ in 1..classes {
        let mut next = vec![f64::NEG_INFINITY; bins + 1];
        let mut from = vec![0; bins + 1];
        for to in 1..=bins {
            for split in 1..to {
                let value = best[split] + gain(split, to);
                if value > next[to] {
                    (next[to], from[to]) = (value, split);
                }
            }
        }
        best = next;
        splits.push(from);
    }
    let mut thresholds = Vec::with_capacity(classes - 1);
    let mut to = bins;
    for from in splits.iter().rev() {
        to = from[to];
        thresholds.push(to);
    }
    thresholds.reverse();
    for split in &mut thresholds {
        // several splits are equally good if the bins after a split are empty; the loop has selected the first of these
        // splits
        let empty = counts[*split..].iter().take_while(|&&count| count == 0).count();
        *split += empty / 2;
    }
    Some(thresholds)
}

/// Returns the mean grey value of each class, or the mean of all bins if `thresholds` is empty.
pub(crate) fn class_means(counts: &[u64], thresholds: &[usize]) -> Vec<f64> {
    let starts = std::iter::once(0).chain(thresholds.iter().copied());
    let ends = thresholds.iter().copied().chain([counts.len()]);
    starts.zip(ends).map(|(from, to)| mean(&counts[from..to], from)).collect()
}

/// Returns the mean grey value of consecutive bins with the given counts; `first` is the number of the first bin.
pub(crate) fn mean(counts: &[u64], first: usize) -> f64 {
    let (mut count, mut moment) = (0, 0);
    for (n, &c) in counts.iter().enumerate() {
        count += c;
        moment += c * (first + n) as u64;
    }
    let bin = moment as f64 / count as f64;
    bin * WIDTH as f64 + (WIDTH as f64 - 1.0) / 2.0
}

/// Returns the grey level that exactly `voxels` voxels reach or exceed, by interpolation in the histogram.
pub(crate) fn level_of(counts: &[u64], voxels: f64) -> f64 {
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

/// Returns the mean grey value of a class, given by a range of grey values. The mean is over the voxels whose whole 5³
/// neighbourhood is in the class; `None` if there are fewer than [`CORE`] such voxels.
pub(crate) fn core_mean(image: &Volume<u16>, inside: &[u8], range: Range<f64>) -> Option<f64> {
    eroded_mean(image, inside, range, core)
}

/// Returns the mean grey value of a class like [`core_mean`], but over the voxels whose 3³ neighbourhood is in the class.
/// Such voxels also exist in a narrow matrix between grains, and at the blurred wall between air and specimen.
/// Therefore, the result is `None` unless the histogram `counts` has a peak within the range of grey values.
pub(crate) fn peaked_mean(
    image: &Volume<u16>,
    inside: &[u8],
    range: Range<f64>,
    counts: &[u64],
) -> Option<f64> {
    let bins = (range.start / WIDTH as f64) as usize..(range.end / WIDTH as f64) as usize;
    let width = bins.len().div_ceil(WINDOWS).max(1);
    let windows: Vec<u64> =
        counts.get(bins)?.windows(width).map(|counts| counts.iter().sum()).collect();
    let edge = (*windows.first()?).max(*windows.last()?);
    let peak = *windows.iter().max()?;
    (peak as f64 > PEAK * edge as f64).then(|| eroded_mean(image, inside, range, erode)).flatten()
}

fn eroded_mean(
    image: &Volume<u16>,
    inside: &[u8],
    range: Range<f64>,
    erosion: impl Fn([usize; 3], &[u8]) -> Vec<u8>,
) -> Option<f64> {
    let values = image.values.par_iter().zip(inside);
    let class: Vec<u8> = values
        .map(|(&value, &inside)| u8::from(range.contains(&f64::from(value))) & inside)
        .collect();
    let core = erosion(image.shape, &class);
    let counts = histogram(&image.values, &core);
    (counts.iter().sum::<u64>() >= CORE).then(|| class_means(&counts, &[])[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn between(counts: &[u64], splits: &[usize]) -> f64 {
        let starts = std::iter::once(0).chain(splits.iter().copied());
        let ends = splits.iter().copied().chain([counts.len()]);
        let all: u64 = counts.iter().sum();
        let mean_of = |from: usize, to: usize| {
            let count: u64 = counts[from..to].iter().sum();
            let moment: u64 = (from..to).map(|n| counts[n] * n as u64).sum();
            (count as f64 / all as f64, moment as f64 / count as f64)
        };
        let (_, centre) = mean_of(0, counts.len());
        starts.zip(ends).map(|(a, b)| mean_of(a, b)).map(|(w, m)| w * (m - centre).powi(2)).sum()
    }

    #[test]
    fn thresholds_agree_with_an_exhaustive_search() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        for _ in 0..20 {
            let counts: Vec<u64> = (0..24).map(|_| rng.random_range(1..50)).collect();
            let two = (1..24).map(|a| between(&counts, &[a])).fold(0.0, f64::max);
            let thresholds = otsu(&counts, 2).unwrap();
            assert!((between(&counts, &thresholds) - two).abs() < 1e-9 * two);
            let three = (1..23)
                .flat_map(|a| (a + 1..24).map(move |b| [a, b]))
                .map(|splits| between(&counts, &splits))
                .fold(0.0, f64::max);
            let thresholds = otsu(&counts, 3).unwrap();
            assert!((between(&counts, &thresholds) - three).abs() < 1e-9 * three);
        }
    }

    #[test]
    fn an_empty_gap_is_split_in_its_middle() {
        let mut counts = vec![0; 20];
        (counts[2], counts[12]) = (5, 9);
        assert_eq!(otsu(&counts, 2).unwrap(), [7]);
        assert_eq!(otsu(&counts, 3), None);
    }
}
