//! Comparison of curves: whether two files have the readings of the same test.

use crate::experiment::TestCurve;

/// Share of the readings that may differ, so that a copy with some edited readings is found.
const DIFFERENT: f64 = 0.02;
/// Share of the readings that may be outside the displacements of the other curve.
const OUTSIDE: f64 = 0.2;
/// Smallest number of readings that are compared.
const LEAST: usize = 5;
/// Relative round-off of a conversion of units.
const ROUND_OFF: f64 = 1e-9;

/// Whether two curves have the readings of the same test, up to a conversion of units, omitted readings, resampling and a few
/// edited readings. Times are not compared. A copy that is rounded to other digits counts as another test.
///
/// The readings of the curve with fewer readings must occur in the other curve, in the same order. A reading occurs if the
/// other curve has a reading with this displacement and force, or if the force that is interpolated between two readings is
/// equal.
pub fn is_same_test(a: &TestCurve, b: &TestCurve) -> bool {
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
                    assert!(is_same_test(pair[0], pair[1]), "{what}: {readings}, {noise_n} N");
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
}
