//! Comparison of curves: whether two files have the readings of the same test.

use crate::experiment::TestCurve;

/// Share of the readings that may differ, so that a copy with some edited readings is found.
const DIFFERENT: f64 = 0.02;
/// Share of the readings that may be outside the displacements of the other curve.
const OUTSIDE: f64 = 0.2;
/// Smallest number of readings that are compared.
const LEAST: usize = 5;
/// Largest rounding of displacements that is considered, relative to the largest displacement: for values that are rounded to
/// decimals in mm, and for other values.
const DISPLACEMENT: [f64; 2] = [1e-2, 0.0];
/// Largest rounding of forces that is considered, relative to the largest force: for values that are rounded to decimals in N,
/// and for other values.
const FORCE: [f64; 2] = [2e-3, 2e-3];
/// Share of different values below which rounding has merged values.
const MERGED: f64 = 0.9;
/// Relative round-off of a conversion of units.
const ROUND_OFF: f64 = 1e-9;

/// Whether two curves have the readings of the same test, up to rounding, omitted readings, resampling and a few edited
/// readings. Times are not compared.
///
/// The readings of the curve with fewer readings must occur in the other curve, in the same order. A reading occurs if the
/// other curve has a reading whose displacement and force are equal up to the rounding of both files, or if the force that is
/// interpolated between two readings is equal. Interpolation is allowed only between readings whose displacements differ by
/// more than the rounding: readings that are denser have the noise of another test within the same displacement. The
/// rounding of a file is estimated from its numbers. It is at most 0.2 % of the largest force, which is far below the
/// scatter between specimens.
pub fn is_same_test(a: &TestCurve, b: &TestCurve) -> bool {
    let (few, many) = if a.force_n.len() <= b.force_n.len() { (a, b) } else { (b, a) };
    if few.force_n.len() < LEAST {
        return a == b;
    }
    let rounding = |values: fn(&TestCurve) -> &[f64], most: [f64; 2]| {
        let largest = [a, b].map(|curve| largest(values(curve)));
        let of_files = [a, b].map(|curve| rounding(values(curve), most));
        0.5 * (of_files[0] + of_files[1]) + ROUND_OFF * largest[0].max(largest[1])
    };
    let tolerance = Tolerance {
        displacement_mm: rounding(|curve| &curve.displacement_mm, DISPLACEMENT),
        force_n: rounding(|curve| &curve.force_n, FORCE),
    };
    let (low, high) = range(&many.displacement_mm);
    let within = (low - tolerance.displacement_mm)..=(high + tolerance.displacement_mm);
    let readings = few.displacement_mm.iter().copied().zip(few.force_n.iter().copied());
    let common: Vec<[f64; 2]> =
        readings.filter(|(u, _)| within.contains(u)).map(|(u, force)| [u, force]).collect();
    let total = few.force_n.len() as f64;
    if common.len() < LEAST || (common.len() as f64) < (1.0 - OUTSIDE) * total {
        return false;
    }
    let allowed = (DIFFERENT * common.len() as f64) as usize;
    let (mut position, mut different) = (0, 0);
    for reading in common {
        match tolerance.occurrence(many, position, reading) {
            Some(next) => position = next,
            None => different += 1,
        }
        if different > allowed {
            return false;
        }
    }
    true
}

/// Largest differences between equal readings.
struct Tolerance {
    displacement_mm: f64,
    force_n: f64,
}

impl Tolerance {
    /// Finds a reading in `curve` from the index `position` on. Returns the index from which the next reading is sought;
    /// `None` if the reading does not occur when the curve first passes its displacement.
    fn occurrence(
        &self,
        curve: &TestCurve,
        position: usize,
        [u, force]: [f64; 2],
    ) -> Option<usize> {
        let (displacement_mm, force_n) = (&curve.displacement_mm, &curve.force_n);
        let is_near = |i: usize| (displacement_mm[i] - u).abs() <= self.displacement_mm;
        let indices = position..force_n.len();
        let passing = indices.skip_while(|&i| !is_near(i)).take_while(|&i| is_near(i));
        let equal = |i: &usize| (force_n[*i] - force).abs() <= self.force_n;
        if let Some(index) = { passing }.find(equal) {
            return Some(index + 1);
        }
        let mut segments = position.saturating_sub(1)..force_n.len().saturating_sub(1);
        let index = segments.find(|&i| {
            let ends = [displacement_mm[i], displacement_mm[i + 1]];
            (ends[0].min(ends[1])..=ends[0].max(ends[1])).contains(&u) && ends[0] != ends[1]
        })?;
        let length = displacement_mm[index + 1] - displacement_mm[index];
        let slope = (force_n[index + 1] - force_n[index]) / length;
        let interpolated = force_n[index] + slope * (u - displacement_mm[index]);
        let allowed = self.force_n + slope.abs() * self.displacement_mm;
        let is_sparse = length.abs() > self.displacement_mm;
        // the reading at the end of the segment may be equal to the next reading
        (is_sparse && (interpolated - force).abs() <= allowed).then_some(index + 1)
    }
}

/// Unit in which the values of a file are rounded: the largest power of ten of which all values are multiples. If there is
/// none, or if rounding has merged values: the smallest difference between two values.
fn rounding(values: &[f64], [most, other_unit]: [f64; 2]) -> f64 {
    let largest = largest(values);
    let is_multiple = |value: f64, unit: f64| {
        let ratio = value / unit;
        (ratio - ratio.round()).abs() * unit <= ROUND_OFF * largest
    };
    let decimals = (-3..=6).map(|digits| 10f64.powi(-digits));
    let decimals = decimals.filter(|unit| *unit > 10.0 * ROUND_OFF * largest);
    let unit = { decimals }.find(|&unit| values.iter().all(|&value| is_multiple(value, unit)));
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let differences = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let differences: Vec<f64> = differences.filter(|d| *d > ROUND_OFF * largest).collect();
    let smallest = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let are_merged = (differences.len() as f64) < MERGED * values.len() as f64;
    match unit {
        // the unit of a conversion can be a multiple of a decimal unit, as 0.01 mil is of 1e-6 mm
        Some(unit) if are_merged => unit.max(smallest).min(most * largest),
        Some(unit) => unit.min(most * largest),
        None if are_merged => smallest.min(most * largest),
        // differences of evenly spaced displacements are no sign of rounding
        None => smallest.min(other_unit * largest),
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

fn range(values: &[f64]) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    values.iter().fold(start, |(low, high), &value| (low.min(value), high.max(value)))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// A test with the given peak force, noise in N and number of readings, with all digits.
    fn test(seed: u64, peak_n: f64, noise_n: f64, readings: usize) -> TestCurve {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let noise = Normal::new(0.0, noise_n).unwrap();
        let displacement_mm: Vec<f64> =
            (0..readings).map(|i| 0.22 * i as f64 / (readings - 1) as f64).collect();
        let mut force = |u: &f64| {
            let x = u / 0.12;
            peak_n * x * ((1.0 - x.powi(3)) / 3.0).exp() + noise.sample(&mut rng)
        };
        let force_n = displacement_mm.iter().map(&mut force).collect();
        TestCurve::new(displacement_mm, force_n)
    }

    fn rounded(curve: &TestCurve, [u, force]: [f64; 2]) -> TestCurve {
        let round =
            |values: &[f64], unit: f64| values.iter().map(|x| (x / unit).round() * unit).collect();
        TestCurve::new(round(&curve.displacement_mm, u), round(&curve.force_n, force))
    }

    fn every(curve: &TestCurve, step: usize) -> TestCurve {
        curve.picked(&(0..curve.force_n.len()).step_by(step).collect::<Vec<_>>())
    }

    #[test]
    fn the_same_test_is_recognised_however_it_was_exported() {
        for (readings, noise_n) in [(45, 0.0), (45, 1.5), (400, 0.3), (4000, 0.0), (4000, 1.5)] {
            let curve = test(1, 150.0, noise_n, readings);
            let all = || 0..readings;
            let without =
                |gone: usize| curve.picked(&all().filter(|&i| i != gone).collect::<Vec<_>>());
            let cut = curve.picked(&(0..readings * 9 / 10).collect::<Vec<_>>());
            let mut edited = curve.clone();
            if readings > 100 {
                edited.force_n[readings / 2] += 9.0;
            }
            let timed = TestCurve { time_s: all().map(|i| i as f64).collect(), ..curve.clone() };
            let in_lbf = rounded(&curve, [1e-4, 0.05 * 4.448_221_615_260_5]);
            for (what, other) in [
                ("equal", curve.clone()),
                ("timed", timed),
                ("rounded", rounded(&curve, [1e-3, 0.1])),
                ("in lbf", in_lbf),
                ("without the first reading", without(0)),
                ("without a reading", without(readings / 3)),
                ("cut", cut),
                ("edited", edited),
                ("thinned and rounded", rounded(&every(&curve, 3), [1e-4, 0.1])),
            ] {
                for pair in [[&curve, &other], [&other, &curve]] {
                    assert!(is_same_test(pair[0], pair[1]), "{what}: {readings}, {noise_n} N");
                }
            }
        }
        // resampled at other displacements
        let smooth = test(1, 150.0, 0.0, 900);
        assert!(is_same_test(&smooth, &test(1, 150.0, 0.0, 97)));
    }

    /// Specimens that scatter by 1 % only, or whose curves differ by their noise only, are different tests, also in coarsely
    /// rounded files.
    #[test]
    fn different_tests_are_not_the_same() {
        for readings in [45, 400, 4000] {
            for (noise_n, peak_n) in [(0.0, 151.5), (0.75, 150.0), (1.5, 151.5), (1.5, 150.0)] {
                let curves =
                    [test(1, 150.0, noise_n, readings), test(2, peak_n, noise_n, readings)];
                for units in [[1e-12, 1e-12], [1e-4, 0.01], [1e-3, 0.1], [1e-3, 0.2]] {
                    let [a, b] = [&curves[0], &curves[1]].map(|curve| rounded(curve, units));
                    let what = format!("{readings}, {noise_n} N, {peak_n} N, {units:?}");
                    assert!(!is_same_test(&a, &b), "{what}");
                    assert!(!is_same_test(&a, &every(&b, 2)), "every second: {what}");
                    assert!(!is_same_test(&every(&a, 3), &b), "every third: {what}");
                }
            }
        }
    }
}
