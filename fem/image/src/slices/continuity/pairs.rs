//! Comparison of each slice with the slices after it.

use rayon::prelude::*;

use super::samples::Samples;
use crate::volume::threshold::otsu;

/// Correlation above which two neighbouring slices show the same content.
const SAME_PICTURE: f64 = 0.8;
/// Number of bins of the histogram of a slice.
const BINS: usize = 64;
/// Largest distance of two slices that are compared.
pub(super) const LAGS: usize = 4;

/// Comparison of a slice with the next slice and with later slices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// Mean absolute difference of the grey values between this slice and the next slice.
    pub(super) next: f64,
    /// Mean absolute difference of the grey values between this slice and the slice after the next; infinite for the
    /// last pair.
    pub(super) after_next: f64,
    /// Mean squared differences between this slice and the slices 1 to [`LAGS`] slices later; `None` beyond the image.
    pub(super) squares: [Option<f64>; LAGS],
    /// Mean of the squared differences between this slice and the next slice, with the sign of the differences: as large
    /// as the mean squared difference where all grey values increase, and small where grains begin and end.
    pub(super) signed: f64,
    /// Standard deviation of the grey values of the slice.
    pub(super) deviation: f64,
    /// Correlation of the grey values of this slice and the next slice.
    pub(super) correlation: f64,
    /// Changes of the mean grey values of the darker and of the brighter class of this slice, divided by the difference
    /// of the classes.
    pub(super) classes: [f64; 2],
    /// Slope of the linear regression of the grey values of the next slice on the grey values of this slice.
    pub(super) gain: f64,
    /// Mean of the next slice minus the mean of this slice.
    pub(super) level: f64,
    /// Standard deviation of the residuals of the linear regression whose slope is `gain`.
    pub(super) residual: f64,
}

/// Moments of the grey values of two slices.
struct Moments {
    means: [f64; 2],
    variances: [f64; 2],
    covariance: f64,
}

impl Moments {
    fn of(values: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let n = values.clone().count().max(1) as f64;
        let (sum_a, sum_b) = values.clone().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
        let means @ [mean_a, mean_b] = [sum_a / n, sum_b / n];
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for (a, b) in values {
            let (a, b) = (a - mean_a, b - mean_b);
            (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
        }
        Moments { means, variances: [aa / n, bb / n], covariance: ab / n }
    }

    fn correlation(&self) -> f64 {
        let product = self.variances[0] * self.variances[1];
        if product > 0.0 { self.covariance / product.sqrt() } else { 0.0 }
    }
}

/// Compares all neighbouring slices.
pub(super) fn compared(samples: &Samples) -> Vec<Pair> {
    (0..samples.slices.len() - 1).into_par_iter().map(|k| Pair::of(samples, k)).collect()
}

impl Pair {
    fn of(samples: &Samples, k: usize) -> Self {
        let depth = samples.slices.len();
        let (slice, next) = (&samples.slices[k], &samples.slices[k + 1]);
        let n = slice.len() as f64;
        let values = || slice.iter().zip(next).map(|(a, b)| (f64::from(*a), f64::from(*b)));
        let all = Moments::of(values());
        let gain = if all.variances[0] > 0.0 { all.covariance / all.variances[0] } else { 1.0 };
        let bound = split(slice);
        let dark = Moments::of(values().filter(|(a, _)| *a < bound));
        let bright = Moments::of(values().filter(|(a, _)| *a >= bound));
        let contrast = (bright.means[0] - dark.means[0]).max(f64::MIN_POSITIVE);
        let after_next = samples.slices.get(k + 2).map_or(f64::INFINITY, |other| {
            slice.iter().zip(other).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / n
        });
        Pair {
            next: values().map(|(a, b)| (a - b).abs()).sum::<f64>() / n,
            after_next,
            squares: std::array::from_fn(|lag| {
                let other = k + 1 + lag;
                (other < depth).then(|| samples.mean_square(k, other))
            }),
            signed: values().map(|(a, b)| (b - a) * (b - a).abs()).sum::<f64>() / n,
            deviation: all.variances[0].sqrt(),
            correlation: all.correlation(),
            classes: [&dark, &bright].map(|class| (class.means[1] - class.means[0]) / contrast),
            gain,
            level: all.means[1] - all.means[0],
            residual: (all.variances[1] - gain * all.covariance).max(0.0).sqrt(),
        }
    }

    /// Returns whether the two slices show the same content.
    pub(super) fn is_alike(&self) -> bool {
        self.correlation > SAME_PICTURE
    }
}

/// Returns the grey value that separates the darker class of a slice from the brighter class (Otsu's method).
fn split(slice: &[f32]) -> f64 {
    let lowest = slice.iter().copied().fold(f32::INFINITY, f32::min);
    let highest = slice.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let width = (f64::from(highest) - f64::from(lowest)) / BINS as f64;
    if width <= 0.0 {
        return f64::from(highest);
    }
    let mut counts = vec![0; BINS];
    for &value in slice {
        counts[((f64::from(value - lowest) / width) as usize).min(BINS - 1)] += 1;
    }
    let bin = otsu(&counts, 2).map_or(BINS / 2, |splits| splits[0]);
    f64::from(lowest) + width * bin as f64
}

/// Returns the pairs up to `distance` pairs before and after pair `k`, without pair `k`.
pub(super) fn neighbours(pairs: &[Pair], k: usize, distance: usize) -> Vec<&Pair> {
    let range = k.saturating_sub(distance)..(k + distance + 1).min(pairs.len());
    range.filter(|&other| other != k).map(|other| &pairs[other]).collect()
}

/// Returns the median of values, or `None` without values.
pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
