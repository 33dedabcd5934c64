//! Spikes: single readings that are higher or lower than both their neighbours.

use super::finding::{Finding, Weight, largest};
use crate::experiment::TestCurve;
use crate::qoi::noise;

/// Least difference between a spike and each of its neighbours, as a fraction of the peak force.
const SPIKE: f64 = 0.05;
/// Largest difference between neighbouring readings that normal noise explains in 20 000 readings, in standard
/// deviations.
const NOISE: f64 = 6.0;
/// Number of spikes that are listed individually.
const EXAMPLES: usize = 5;

/// Finds the spikes of a curve, the largest first: at most [`EXAMPLES`] spikes individually, then the number of the
/// other spikes. The noise of a force is at least `least_noise_n`.
pub(super) fn spikes(curve: &TestCurve, least_noise_n: f64) -> Vec<Finding> {
    let (u, force) = (&curve.displacement_mm, &curve.force_n);
    let top = largest(force);
    let mut steps: Vec<f64> = force.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let usual_step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    // the limit is relative to the second highest force: a spike at the highest reading must not increase its own limit
    let mut forces = force.clone();
    forces.sort_unstable_by(f64::total_cmp);
    let scale = forces[forces.len().saturating_sub(2)];
    let noise_n = noise::of_single_readings(u, force).max(least_noise_n);
    let limit = (SPIKE * scale).max(3.0 * usual_step).max(NOISE * noise_n);
    let height = |i: usize| {
        let [before, after] = [force[i] - force[i - 1], force[i] - force[i + 1]];
        let is_spike = before * after > 0.0;
        if is_spike { before.signum() * before.abs().min(after.abs()) } else { 0.0 }
    };
    let inner = 1..force.len().saturating_sub(1);
    let mut outliers: Vec<(usize, f64)> =
        inner.map(|i| (i, height(i))).filter(|(_, height)| height.abs() > limit).collect();
    outliers.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let weight = |i: usize| if i == top { Weight::Error } else { Weight::Warning };
    let mut findings: Vec<Finding> = outliers
        .iter()
        .enumerate()
        // a spike at the highest reading is an error and is always listed
        .filter(|(rank, (i, _))| *rank < EXAMPLES || *i == top)
        .map(|(_, &(i, height))| Finding {
            name: "spike",
            value: force[i],
            problem: format!(
                "has a single reading of {} N at {} mm, {height:+.4} N from its neighbours \
                 (noise: {noise_n:.3} N)",
                force[i], u[i]
            ),
            help: "Remove the reading.",
            weight: weight(i),
        })
        .collect();
    if let Some(further) = outliers.len().checked_sub(findings.len()).filter(|&count| count > 0) {
        findings.push(Finding {
            name: "spike",
            value: further as f64,
            problem: format!(
                "has {further} further readings more than {limit:.4} N from their neighbours"
            ),
            help: "Remove these readings, or filter the record.",
            weight: Weight::Warning,
        });
    }
    findings
}
