//! Checks of the origin of force and displacement: preload, load cell that was not zeroed, late loading, toe.

use super::finding::{Finding, Weight, largest};
use crate::experiment::TestCurve;
use crate::qoi::{Line, Qois, Window, noise, slope_line};

/// Largest median force of the first readings, as a fraction of the peak force, that is not reported as a preload.
const PRELOAD: f64 = 0.02;
/// Largest onset of loading that counts as a soft start. The onset is the displacement at which loading begins, as a
/// fraction of the displacement from the onset to the peak. A larger onset is reported as late loading.
const LATE: f64 = 0.25;
/// Force, as a fraction of the highest force, above which a specimen counts as loaded.
const LOADED: f64 = 0.05;
/// Toe, as a fraction of the displacement at peak, above which a warning is reported.
const TOE: f64 = 0.02;

/// Median force of the first readings and its standard error, N. The noise of a force is at least `least_noise_n`.
fn first_force(curve: &TestCurve, least_noise_n: f64) -> (f64, f64) {
    let count = (curve.force_n.len() / 200).clamp(1, 25);
    let mut first = curve.force_n[..count].to_vec();
    first.sort_unstable_by(f64::total_cmp);
    let noise_n =
        noise::standard_deviation(&curve.displacement_mm, &curve.force_n).max(least_noise_n);
    // the standard error of the median is √(π/2) times the standard error of the mean
    (first[count / 2], 1.25 * noise_n / (count as f64).sqrt())
}

pub(super) fn preload(curve: &TestCurve, qois: &Qois, least_noise_n: f64) -> Option<Finding> {
    let (value, error) = first_force(curve, least_noise_n);
    (value > PRELOAD * qois.peak_force_n + 3.0 * error).then(|| Finding {
        name: "preload",
        value,
        problem: format!("begins at {value:.4} N"),
        help: "Displacement must be counted from the unloaded specimen: toe = \"correct\" under \
               [experiments] extrapolates to it. If the specimen was unloaded there, the load cell was not \
               zeroed: write zero_force = true under [experiments.read].",
        weight: Weight::Warning,
    })
}

/// Reports a load cell that was not zeroed: the force is negative, but platens cannot pull a specimen.
pub(super) fn force_zero(curve: &TestCurve, least_noise_n: f64) -> Option<Finding> {
    let (value, error) = first_force(curve, least_noise_n);
    let peak_n = curve.force_n.iter().copied().fold(0.0, f64::max);
    (value < -(PRELOAD * peak_n + 3.0 * error)).then(|| Finding {
        name: "force-zero",
        value,
        problem: format!("begins at {value:.4} N, in tension: its load cell was not zeroed"),
        help: "Peak and slope would be wrong by this force: subtract it from force_N, or write \
               zero_force = true under [experiments.read].",
        weight: Weight::Error,
    })
}

/// Displacement (mm) after which the specimen stays loaded; `None` if this displacement is so small that it counts as a
/// soft start. A late onset is caused by the approach of the platen, or by a displacement that was not zeroed.
pub(super) fn late_onset_mm(curve: &TestCurve, least_noise_n: f64) -> Option<f64> {
    let (u, force) = (&curve.displacement_mm, &curve.force_n);
    let noise_n = noise::standard_deviation(u, force).max(least_noise_n);
    let top = largest(force);
    let limit = LOADED * force[top] + 3.0 * noise_n;
    let is_loaded = |from: usize| force[from..top].iter().take(3).all(|&force| force > limit);
    let first_loaded = (0..top).find(|&from| is_loaded(from))?;
    let onset_mm = u[first_loaded.checked_sub(1)?];
    (onset_mm > LATE * (u[top] - onset_mm)).then_some(onset_mm)
}

pub(super) fn late_load(onset_mm: f64) -> Finding {
    Finding {
        name: "late-load",
        value: onset_mm,
        problem: format!("is not loaded before {onset_mm:.4} mm"),
        help: "Displacement must be counted from where loading begins: subtract it, or write \
               toe = \"correct\" under [experiments].",
        weight: Weight::Error,
    }
}

pub(super) fn toe(toe_mm: f64, qois: &Qois) -> Finding {
    let part = toe_mm / qois.displacement_at_peak_mm;
    let large = part.abs() > TOE;
    Finding {
        name: "toe",
        value: toe_mm,
        problem: format!(
            "begins to carry load at {toe_mm:.4} mm, {:.1} % of its displacement at peak",
            100.0 * part
        ),
        help: "The displacement at peak includes the toe; toe = \"correct\" under [experiments] measures \
               displacement from the end of the toe.",
        weight: if large { Weight::Warning } else { Weight::Note },
    }
}

/// Displacement (mm) at which the force would begin to rise if the curve had no soft start.
///
/// The tangent at the window of the slope is extrapolated to zero force, and the result is corrected for the curvature
/// of the curve. The correction assumes viscous damage: with the displacement v after the toe and x = v/v_peak, the
/// force is F ∝ v exp(−x³/3). The tangent at v then has zero force at −v x³/(1 − x³) instead of 0.
pub(super) fn toe_mm(curve: &TestCurve, qois: &Qois, slope_fraction: f64) -> f64 {
    let peak = qois.displacement_at_peak_mm;
    let window = Window::around(slope_fraction, peak);
    let Ok(Line { middle_mm: middle, mean: force, .. }) = slope_line(curve, window) else {
        return 0.0;
    };
    let line = middle - force / qois.slope_n_per_mm;
    let mut toe = line;
    for _ in 0..50 {
        let x = ((middle - toe) / (peak - toe)).clamp(0.0, 0.9);
        let bend = x.powi(3) / (1.0 - x.powi(3));
        toe = line + (middle - toe) * bend;
    }
    toe
}
