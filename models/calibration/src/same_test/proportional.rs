//! Recognises a copy of a curve whose forces are multiplied by a constant.

use super::resolution::Resolution;
use super::rounded::{DIFFERENT, MOST_DIFFERENT, OUTSIDE};
use crate::experiment::TestCurve;

/// Smallest number of readings: the noise of fewer readings cannot be compared.
const LEAST: usize = 20;
/// Smallest ratio of the noise of the forces to the rounding of their digits. Noise below the rounding is not the same noise.
const NOISE: f64 = 4.0;
/// Smallest ratio of the sixth to the fourth differences of the forces, each normalised to the standard deviation of white
/// noise. The differences of a smooth curve without noise fall with their order: two virtual specimens may have proportional
/// curves without noise.
const WHITE: f64 = 0.6;
/// Smallest ratio of the noise of the forces to the noise that irregular displacements cause.
const OF_FORCES: f64 = 3.0;

/// Whether the forces of two curves are proportional, with the same noise: the readings of one test, multiplied by a
/// constant. Readings may be missing at the start and at the end of one of the curves, and a few may be edited.
///
/// The ratio of the forces of two tests varies by their noise, which is much larger than the rounding of the digits.
/// Curves whose noise is not larger than their rounding cannot be told from curves of two equal specimens.
pub(super) fn is_proportional_copy(a: &TestCurve, b: &TestCurve) -> bool {
    let (few, many) = if a.force_n.len() <= b.force_n.len() { (a, b) } else { (b, a) };
    let count = few.force_n.len();
    if count < LEAST || many.force_n.len() < LEAST || !has_noise(few) {
        return false;
    }
    let missing = (OUTSIDE * count as f64) as usize;
    let resolution = Resolution::of(&few.displacement_mm);
    let other_resolution = Resolution::of(&many.displacement_mm);
    let is_near = |u: f64, other: f64| {
        (u - other).abs() <= 0.5 * (resolution.at(u) + other_resolution.at(other)) * (1.0 + 1e-6)
    };
    // the first common reading is the first reading of one of the curves
    let starts = |from: &TestCurve, of: &TestCurve, most: usize| -> Vec<usize> {
        let first = from.displacement_mm[0];
        (0..of.force_n.len().min(most + 1))
            .filter(|&i| is_near(first, of.displacement_mm[i]))
            .collect()
    };
    let longest = many.force_n.len() - count + missing;
    let in_many = starts(few, many, longest).into_iter().map(|start| [0, start]);
    let in_few = starts(many, few, missing).into_iter().map(|start| [start, 0]);
    in_many.chain(in_few).any(|[i, j]| {
        let length = (count - i).min(many.force_n.len() - j);
        let is_long = length >= LEAST && length as f64 >= (1.0 - OUTSIDE) * count as f64;
        let displacements = few.displacement_mm[i..].iter().zip(&many.displacement_mm[j..]);
        is_long
            && displacements.take(length).all(|(u, other)| is_near(*u, *other))
            && are_proportional(&few.force_n[i..i + length], &many.force_n[j..j + length])
    })
}

/// Whether the noise of a curve is white and comes from its forces.
fn has_noise(curve: &TestCurve) -> bool {
    let noise = white_noise(&curve.force_n, FOURTH);
    let [force, displacement] = [&curve.force_n, &curve.displacement_mm]
        .map(|values| values.iter().fold(0.0, |most: f64, value| value.abs().max(most)));
    let by_displacements = force / displacement * white_noise(&curve.displacement_mm, FOURTH);
    white_noise(&curve.force_n, SIXTH) >= WHITE * noise && noise >= OF_FORCES * by_displacements
}

/// Whether a constant factor explains the differences of the forces up to the rounding of their digits, and the noise is
/// larger than this rounding.
fn are_proportional(a: &[f64], b: &[f64]) -> bool {
    let largest = a.iter().fold(0.0, |most: f64, force| force.abs().max(most));
    let large = a.iter().zip(b).filter(|(a, _)| **a > 0.5 * largest);
    let mut ratios: Vec<f64> = large.map(|(a, b)| b / a).collect();
    let factor = median(&mut ratios);
    // NaN: no force is positive
    if factor.is_nan() || factor <= 0.0 {
        return false;
    }
    let (of_a, of_b) = (Resolution::of(a), Resolution::of(b));
    let rounding =
        |a: f64, b: f64| 0.75 * (factor * of_a.at(a) + of_b.at(b)) + 1e-9 * factor * largest;
    if factor * white_noise(a, FOURTH) < NOISE * rounding(largest, factor * largest) {
        return false;
    }
    let differs = |(a, b): &(&f64, &f64)| (*b - factor * *a).abs() > rounding(**a, **b);
    let different = a.iter().zip(b).filter(differs).count();
    different <= ((DIFFERENT * a.len() as f64) as usize).min(MOST_DIFFERENT)
}

/// Coefficients of the fourth and the sixth difference.
const FOURTH: &[f64] = &[1.0, -4.0, 6.0, -4.0, 1.0];
const SIXTH: &[f64] = &[1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
/// Median of the size of a standard normal variable.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_750_196;

/// Standard deviation of white noise, from differences of the values. The median leaves out kinks and edited readings.
fn white_noise(values: &[f64], coefficients: &[f64]) -> f64 {
    let norm = coefficients.iter().map(|c| c * c).sum::<f64>().sqrt();
    let difference = |window: &[f64]| {
        let terms = window.iter().zip(coefficients).map(|(value, c)| value * c);
        terms.sum::<f64>().abs()
    };
    let mut sizes: Vec<f64> = values.windows(coefficients.len()).map(difference).collect();
    median(&mut sizes) / (MEDIAN_OF_NORMAL * norm)
}

/// Median; NaN if there are no values.
fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
