//! Order and sign of the readings of a curve.

use super::finding::{Finding, Weight, largest};
use crate::experiment::TestCurve;
use crate::qoi::noise;

/// Largest tolerated decrease of the displacement before the peak, as a fraction of the displacement from start to
/// peak.
const BACK: f64 = 0.05;
/// Largest standard deviation of the displacement, as a fraction of the displacement from start to peak, that counts as
/// noise. The order of the readings is not checked if their noise is larger.
const NOISE: f64 = 0.02;
/// Largest decrease of the displacement that noise explains, in standard deviations of one reading: the expected
/// difference between the largest and the smallest of 20 000 normal deviations.
pub(super) const NOISE_BACK: f64 = 8.0;

/// Checks order and sign of the readings, and returns the first error found.
pub(super) fn order(curve: &TestCurve) -> Option<Finding> {
    signs(curve).or_else(|| sequence(curve))
}

fn error(name: &'static str, value: f64, problem: String, help: &'static str) -> Option<Finding> {
    Some(Finding { name, value, problem, help, weight: Weight::Error })
}

/// Checks that displacement and force increase from the start of a loading, and returns the first error found.
pub(super) fn signs(curve: &TestCurve) -> Option<Finding> {
    let (u, force) = (&curve.displacement_mm, &curve.force_n);
    let (last, top, farthest) = (u.len().checked_sub(1)?, largest(force), largest(u));
    let lowest = force.iter().copied().fold(f64::INFINITY, f64::min);
    let least = u.iter().copied().fold(f64::INFINITY, f64::min);
    let span = u[farthest] - least;
    if span <= 0.0 {
        return error(
            "displacement",
            u[0],
            format!("stays at a displacement of {} mm", u[0]),
            "Check the column displacement_mm.",
        );
    }
    if -lowest > 3.0 * force[top] {
        return error(
            "sign-of-force",
            lowest,
            format!("has forces down to {lowest} N and up to {} N only", force[top]),
            "Compression is positive: change the sign of force_N, and of displacement_mm if displacement_mm \
             decreases.",
        );
    }
    // if one column rises to the end and the other column has a peak, the rising column is the displacement
    let comes_back = u[farthest] - u[last] > 0.05 * span && farthest > 0;
    let rises = force[last] - force[farthest] > 0.05 * (force[top] - lowest);
    if comes_back && rises && top + 1 + force.len() / 20 > last {
        return error(
            "columns-swapped",
            u[farthest],
            format!("has its largest displacement_mm, {}, before its largest force_N", u[farthest]),
            "Check whether the two columns are swapped: force has a peak, displacement rises to the end.",
        );
    }
    if u[0] - u[last] > 0.5 * span {
        // the force is zero at the start of a test, and not at its end
        let loaded = [force[0], force[last]].map(|f| f > 0.1 * force[top]);
        let is_reversed = match loaded {
            [true, false] => true,
            [false, true] => false,
            _ => u[last].abs() < u[0].abs(),
        };
        return if is_reversed {
            error(
                "order",
                u[0] - u[last],
                format!("begins at {} mm and ends at {} mm, without force", u[0], u[last]),
                "The rows are in reverse order: write the first reading first.",
            )
        } else {
            error(
                "sign-of-displacement",
                u[last],
                format!("has displacements that decrease from {} to {} mm", u[0], u[last]),
                "Compression is positive: change the sign of displacement_mm.",
            )
        };
    }
    None
}

/// Checks that the displacement increases from reading to reading, and returns the first error found.
fn sequence(curve: &TestCurve) -> Option<Finding> {
    let u = &curve.displacement_mm;
    let (top, farthest) = (largest(&curve.force_n), largest(u));
    let least = u.iter().copied().fold(f64::INFINITY, f64::min);
    let way = (u[top] - u[0]).max(BACK * (u[farthest] - least));
    let noise_mm = noise_of_displacement(u);
    if noise_mm > NOISE * way && setback(u) > BACK * way {
        return error(
            "order",
            noise_mm,
            format!("has displacements that vary by {noise_mm:.4} mm from reading to reading"),
            "Sort its rows by time.",
        );
    }
    let back = setback(&u[..=top]);
    if back > (BACK * way).max(NOISE_BACK * noise_mm) {
        return error(
            "order",
            back,
            format!("has displacements that decrease by {back:.4} mm before its peak"),
            "Sort the rows, or keep the rows of one monotonic loading only: slope and peak come from one loading.",
        );
    }
    None
}

/// Returns the largest decrease of the displacement below its preceding maximum.
fn setback(u: &[f64]) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    let back = u.iter().map(|&x| {
        largest = largest.max(x);
        largest - x
    });
    back.fold(0.0, f64::max)
}

/// Standard deviation (mm) of the noise of one reading of the displacement. The noise is estimated from the
/// displacement as a function of the reading's index.
pub(super) fn noise_of_displacement(u: &[f64]) -> f64 {
    let number: Vec<f64> = (0..u.len()).map(|i| i as f64).collect();
    noise::of_single_readings(&number, u)
}
