//! Comparison of curves: whether two files have the readings of the same test.

mod resolution;
mod rounded;

use crate::experiment::TestCurve;
use rounded::{DIFFERENT, OUTSIDE, is_rounded_copy};

/// Smallest number of readings that are compared.
const LEAST: usize = 5;
/// Relative round-off of a conversion of units.
const ROUND_OFF: f64 = 1e-9;

/// How two curves share the readings of one test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SameTest {
    /// The readings are equal, up to a conversion of units, omitted readings, resampling and a few edited readings.
    Readings,
    /// The readings are equal up to the rounding of their printed digits, and up to a constant displacement.
    Rounded,
}

impl SameTest {
    /// Compares two curves; `None` if they are the curves of two tests. Times are not compared.
    pub fn of(a: &TestCurve, b: &TestCurve) -> Option<Self> {
        if has_same_readings(a, b) {
            return Some(Self::Readings);
        }
        is_rounded_copy(a, b).then_some(Self::Rounded)
    }
}

/// Whether the readings of the curve with fewer readings occur in the other curve, in the same order. A reading occurs if
/// the other curve has a reading with this displacement and force, or if the force that is interpolated between two
/// readings is equal.
fn has_same_readings(a: &TestCurve, b: &TestCurve) -> bool {
    let (few, many) = if a.force_n.len() <= b.force_n.len() { (a, b) } else { (b, a) };
    if few.force_n.len() < LEAST {
        return a == b;
    }
    let tolerance = Tolerance {
        displacement_mm: ROUND_OFF * largest(&a.displacement_mm).max(largest(&b.displacement_mm)),
        force_n: ROUND_OFF * largest(&a.force_n).max(largest(&b.force_n)),
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

    fn is_same_test(a: &TestCurve, b: &TestCurve) -> bool {
        SameTest::of(a, b).is_some()
    }

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

    /// Interpolates a curve with constant spacing linearly at `readings` displacements.
    fn resampled(curve: &TestCurve, readings: usize) -> TestCurve {
        let segments = (curve.force_n.len() - 1) as f64;
        let at = |values: &[f64], i: usize| {
            let position = segments * i as f64 / (readings - 1) as f64;
            let start = (position as usize).min(values.len() - 2);
            values[start] + (position - start as f64) * (values[start + 1] - values[start])
        };
        let all = |values: &[f64]| (0..readings).map(|i| at(values, i)).collect();
        TestCurve::new(all(&curve.displacement_mm), all(&curve.force_n))
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
            let in_kn = curve.force_n.iter().map(|force| 1e-3 * force * 1e3).collect();
            let in_kn = TestCurve::new(curve.displacement_mm.clone(), in_kn);
            for (what, other) in [
                ("equal", curve.clone()),
                ("timed", timed),
                ("in kN", in_kn),
                ("without the first reading", without(0)),
                ("without a reading", without(readings / 3)),
                ("cut", cut),
                ("edited", edited),
                ("thinned", every(&curve, 3)),
            ] {
                for pair in [[&curve, &other], [&other, &curve]] {
                    assert_eq!(
                        SameTest::of(pair[0], pair[1]),
                        Some(SameTest::Readings),
                        "{what}: {readings}, {noise_n} N"
                    );
                }
            }
        }
        for noise_n in [0.0, 1.5] {
            let curve = test(1, 150.0, noise_n, 900);
            let other = resampled(&curve, 97);
            assert!(is_same_test(&curve, &other) && is_same_test(&other, &curve), "{noise_n} N");
        }
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

    #[test]
    fn copies_with_other_digits_or_a_shift_are_recognised() {
        for (readings, noise_n) in [(45, 0.0), (45, 1.5), (400, 0.3), (4000, 0.0), (4000, 1.5)] {
            let curve = test(1, 150.0, noise_n, readings);
            let fine = rounded(&curve, [1e-5, 1e-3]);
            let shifted = |by_mm: f64| fine.shift_displacement(by_mm);
            let digits = |curve: &TestCurve, digits: usize| {
                let print = |x: &f64| format!("{x:.*e}", digits - 1).parse().unwrap();
                let all = |values: &[f64]| values.iter().map(print).collect();
                TestCurve::new(all(&curve.displacement_mm), all(&curve.force_n))
            };
            let pounds = 4.448_221_615_260_5;
            let cut = curve.picked(&(1..readings * 9 / 10).collect::<Vec<_>>());
            let mut edited = rounded(&curve, [1e-4, 0.1]);
            if readings > 100 {
                edited.force_n[readings / 2] += 9.0;
            }
            for (what, other) in [
                ("three decimals", rounded(&curve, [1e-3, 0.1])),
                ("four digits", digits(&curve, 4)),
                ("pounds", rounded(&curve, [25.4e-4, 0.01 * pounds])),
                ("nine digits", digits(&curve, 9)),
                ("shifted", shifted(0.0317)),
                ("shifted and rounded", rounded(&shifted(0.003_217), [1e-4, 0.1])),
                ("cut", rounded(&cut, [1e-3, 0.1])),
                ("edited", edited),
            ] {
                for pair in [[&fine, &other], [&other, &fine]] {
                    let same = SameTest::of(pair[0], pair[1]);
                    assert_eq!(same, Some(SameTest::Rounded), "{what}: {readings}, {noise_n} N");
                }
            }
            if readings > 100 {
                let thinned = rounded(&every(&curve, 3), [1e-3, 0.1]);
                for other in [thinned, rounded(&curve, [1e-3, 0.5])] {
                    assert_eq!(SameTest::of(&fine, &other), Some(SameTest::Rounded));
                }
            }
        }
    }

    /// Specimens of a material with little scatter, recorded with little noise and few digits.
    #[test]
    fn different_tests_of_a_material_with_little_scatter_are_not_copies() {
        for readings in [45, 400, 4000] {
            // peak of the second specimen and noise, N
            for (peak_n, noise_n) in [(150.6, 0.0), (150.3, 0.1), (150.0, 0.15), (150.1, 0.15)] {
                let [a, b] = [(1, 150.0), (2, peak_n)]
                    .map(|(seed, peak_n)| test(seed, peak_n, noise_n, readings));
                for units in [[1e-5, 1e-3], [1e-4, 0.01], [1e-3, 0.1], [1e-3, 0.2]] {
                    for other in [[1e-5, 1e-3], units] {
                        let pair = [rounded(&a, units), rounded(&b, other)];
                        let what =
                            format!("{readings}: {peak_n} N ± {noise_n}, {units:?}, {other:?}");
                        assert_eq!(SameTest::of(&pair[0], &pair[1]), None, "{what}");
                        let thin = every(&pair[0], 2);
                        assert_eq!(SameTest::of(&thin, &pair[1]), None, "every second: {what}");
                    }
                }
            }
        }
    }
}
