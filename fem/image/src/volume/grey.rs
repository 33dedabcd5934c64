//! Grey values rounded to 16 bits between two percentiles.

use rayon::prelude::*;

use crate::volume::voxel_at;
use crate::{ImageError, Volume};

/// 16-bit values to which the lower and the upper percentile are mapped. An eighth of the 16-bit range remains below
/// `LOW` for darker voxels, and an eighth above `HIGH` for brighter voxels.
pub(crate) const LOW: u16 = 8192;
pub(crate) const HIGH: u16 = 57344;

/// Rounds to the nearest integer, ties to even, for absolute values below 2⁵¹. This function compiles to two additions,
/// whereas `f64::round` is a function call.
pub(crate) fn rounded(value: f64) -> f64 {
    // 1.5 · 2⁵². All floating-point numbers of this magnitude are integers, so that adding and subtracting this number
    // rounds
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    (value + WHOLE) - WHOLE
}

/// Linear map between 16-bit values and the grey values of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    /// Converts a grey value of the image to the scale of the 16-bit values, without rounding.
    pub(crate) fn to_16_bits(self, value: f64) -> f64 {
        let share = (value - self.low) / (self.high - self.low);
        f64::from(LOW) + share * f64::from(HIGH - LOW)
    }

    /// Returns the scale of the inverted image. The 16-bit values of the inverted image are 65535 minus the 16-bit
    /// values of this scale.
    pub(crate) fn inverted(self) -> Self {
        let [low, high] = [LOW, HIGH].map(|value| self.to_image(f64::from(u16::MAX - value)));
        Scale { low, high }
    }

    /// Converts a 16-bit value to the grey value of the image.
    pub(crate) fn to_image(self, value: f64) -> f64 {
        let share = (value - f64::from(LOW)) / f64::from(HIGH - LOW);
        self.low + share * (self.high - self.low)
    }
}

/// Rounds an image to 16 bits; the given percentiles map to [`LOW`] and [`HIGH`].
///
/// # Errors
/// [`ImageError`] for values that are not finite, and for an image of one value.
pub(crate) fn rescale(
    image: &Volume<f32>,
    percentiles: [f64; 2],
) -> Result<(Volume<u16>, Scale), ImageError> {
    if let Some(at) = image.values.par_iter().position_first(|value| !value.is_finite()) {
        let voxel = voxel_at(image.shape, at);
        return Err(ImageError::NotFinite { voxel, value: image.values[at] });
    }
    let last = (image.values.len() - 1) as f64;
    let ranks = percentiles.map(|percent| (percent / 100.0 * last).round() as u64);
    let [mut low, mut high] = ranked(&image.values, ranks).map(f64::from);
    if low >= high {
        // both percentiles have the same value: use the smallest and the largest value instead
        [low, high] = ranked(&image.values, [0, last as u64]).map(f64::from);
    }
    if low >= high {
        return Err(ImageError::NoContrast {
            what: format!("all voxels have the grey value {low}"),
            help: "check that the image was saved with its grey values",
        });
    }
    let scale = Scale { low, high };
    let round =
        |&value: &f32| rounded(scale.to_16_bits(f64::from(value)).clamp(0.0, 65535.0)) as u16;
    Ok((image.with(image.values.par_iter().map(round).collect()), scale))
}

/// Returns the values at two positions (`ranks`) of the sorted order, without sorting, by a radix selection in two
/// passes over 16-bit digits.
fn ranked(values: &[f32], ranks: [u64; 2]) -> [f32; 2] {
    let first = counts(values, |key| Some((key >> 16) as usize));
    ranks.map(|rank| {
        let (high, below) = bin_of_rank(&first, rank);
        let second =
            counts(values, |key| ((key >> 16) as usize == high).then_some((key & 0xffff) as usize));
        let (low, _) = bin_of_rank(&second, rank - below);
        value_of((high as u32) << 16 | low as u32)
    })
}

/// Returns the number of values for each digit. `digit` returns the digit of a value, or `None` if the value is not
/// counted.
fn counts(values: &[f32], digit: impl Fn(u32) -> Option<usize> + Sync) -> Vec<u64> {
    let add = |mut counts: Vec<u64>, portion: &[f32]| {
        for &value in portion {
            if let Some(digit) = digit(key(value)) {
                counts[digit] += 1;
            }
        }
        counts
    };
    values.par_chunks(1 << 20).fold(|| vec![0; 1 << 16], add).reduce(|| vec![0; 1 << 16], sum)
}

/// Returns the sum of two histograms.
pub(crate) fn sum(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

/// Returns the bin that contains the value with the given rank in sorted order, and the number of values in the bins
/// before this bin.
fn bin_of_rank(counts: &[u64], rank: u64) -> (usize, u64) {
    let mut below = 0;
    for (bin, &count) in counts.iter().enumerate() {
        if rank < below + count {
            return (bin, below);
        }
        below += count;
    }
    (counts.len() - 1, below)
}

/// Converts a number to an integer that represents its bits; the integers have the same order as the numbers, and −0
/// counts as 0.
fn key(value: f32) -> u32 {
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Converts an integer returned by [`key`] back to the number.
fn value_of(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & !(1 << 31) } else { !key })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn ranked_values_agree_with_sorting() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut values: Vec<f32> =
            (0..5000).map(|_| rng.random_range(-2.0_f32..3.0).powi(5)).collect();
        values.extend([0.0, -0.0, 1e30, -1e30]);
        let mut sorted = values.clone();
        sorted.sort_by(f32::total_cmp);
        for ranks in [[0, 5003], [5, 4990], [2500, 2501]] {
            assert_eq!(ranked(&values, ranks), ranks.map(|rank| sorted[rank as usize]));
        }
    }

    #[test]
    fn rounding_agrees_with_the_standard_library() {
        for value in [0.0, 0.4, 0.6, 7.5, -0.6, -3.2, 65534.51, -1e9 + 0.3] {
            assert_eq!(rounded(value), f64::round_ties_even(value));
        }
    }

    #[test]
    fn one_bright_voxel_does_not_change_the_scale() {
        let mut values: Vec<f32> = (0..8000).map(|n| (n % 100) as f32).collect();
        values[17] = 1e9;
        let image = Volume::new([20, 20, 20], 1.0, values).unwrap();
        let (grey, scale) = rescale(&image, [0.1, 99.9]).unwrap();
        assert_eq!((grey.values[0], grey.values[17]), (LOW, u16::MAX));
        assert!((scale.to_image(f64::from(grey.values[42])) - 42.0).abs() < 2e-3);
    }
}
