//! Checks of a measured curve: order and sign of the readings, spikes, preload, toe, unloading, sampling.

mod finding;
mod order;
mod origin;
mod spikes;
#[cfg(test)]
mod tests;

use crate::experiment::TestCurve;
use crate::qoi::{QoiError, Qois, Window};
use finding::largest;
pub use finding::{Finding, Weight};
use order::{NOISE_BACK, noise_of_displacement, order};
use origin::{force_zero, late_load, late_onset_mm, preload, toe, toe_mm};
use spikes::spikes;

/// Least number of readings before the peak; fewer are reported as sparse.
const SPARSE: usize = 10;
/// Largest gap between readings before the peak, as a fraction of the displacement at peak; a wider gap is reported.
const GAP: f64 = 0.15;

/// Curve with the findings of its checks.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectedCurve {
    /// Findings, in the order of the checks.
    pub findings: Vec<Finding>,
    /// Displacement (mm) at which loading begins: see `toe_mm` in `origin.rs`.
    pub toe_mm: f64,
    /// The curve up to its largest displacement.
    pub loading: TestCurve,
    /// Displacement (mm) at which loading begins after the approach of the platen or an offset; 0 if loading begins at
    /// the start of the curve or with a soft start.
    onset_mm: f64,
}

impl InspectedCurve {
    /// Checks a curve. The initial slope is computed at `slope_fraction` times the displacement at peak.
    pub fn of(curve: &TestCurve, slope_fraction: f64) -> Self {
        let mut found =
            Self { findings: Vec::new(), toe_mm: 0.0, loading: curve.clone(), onset_mm: 0.0 };
        if let Some(finding) = order(curve) {
            found.findings.push(finding);
            return found;
        }
        found.cut_unloading();
        found.findings.extend(spikes(&found.loading));
        found.findings.extend(force_zero(&found.loading));
        if let Some(onset_mm) = late_onset_mm(&found.loading) {
            found.findings.push(late_load(onset_mm));
            found.onset_mm = onset_mm;
        }
        let loading = found.after_onset();
        match Qois::of(&loading, slope_fraction) {
            Err(reason) => found.findings.push(without_quantities(&reason)),
            Ok(qois) if qois.slope_n_per_mm <= 0.0 => found.findings.push(Finding {
                name: "slope",
                value: qois.slope_n_per_mm,
                problem: format!("has an initial slope of {:.4} N/mm", qois.slope_n_per_mm),
                help: "Force must rise with displacement in the window of the slope: check the curve, \
                       or slope_fraction.",
                weight: Weight::Error,
            }),
            Ok(qois) => {
                let toe_mm = toe_mm(&loading, &qois, slope_fraction);
                found.toe_mm = found.onset_mm + toe_mm;
                found.findings.extend(preload(&loading, &qois));
                found.findings.push(toe(toe_mm, &qois));
                found.findings.extend(sampling(&loading, &qois, slope_fraction));
            }
        }
        found
    }

    /// Returns the loading branch with displacements measured from the toe, and the shift of the displacements in mm.
    pub fn without_toe(&self, slope_fraction: f64) -> (TestCurve, f64) {
        let mut curve = self.after_onset();
        let mut moved = self.onset_mm;
        // the window of the slope moves with the origin: both converge in a few iterations
        for _ in 0..4 {
            let Ok(qois) = Qois::of(&curve, slope_fraction) else { break };
            let toe = toe_mm(&curve, &qois, slope_fraction);
            curve = curve.shift_displacement(-toe);
            moved += toe;
        }
        (curve, moved)
    }

    /// Returns the loading branch after the approach of the platen, with displacements measured from the end of the
    /// approach.
    fn after_onset(&self) -> TestCurve {
        if self.onset_mm == 0.0 {
            return self.loading.clone();
        }
        let TestCurve { displacement_mm, force_n } = &self.loading;
        let readings = displacement_mm.iter().zip(force_n).skip_while(|(u, _)| **u < self.onset_mm);
        let (displacement_mm, force_n) = readings.map(|(u, f)| (u - self.onset_mm, *f)).unzip();
        TestCurve { displacement_mm, force_n }
    }

    /// Removes the readings after the largest displacement, if displacement decreases by more than noise, and reports
    /// the removal.
    fn cut_unloading(&mut self) {
        let u = &self.loading.displacement_mm;
        let (farthest, last) = (largest(u), u.len() - 1);
        let back = u[farthest] - u[last];
        let by_noise = NOISE_BACK * noise_of_displacement(u);
        if back <= (0.02 * (u[farthest] - u[0])).max(by_noise) {
            return;
        }
        let value = u[farthest];
        self.findings.push(Finding {
            name: "unloading",
            value,
            problem: format!(
                "has displacements that decrease from {value:.4} mm by {back:.4} mm at its end"
            ),
            help: "The readings after the largest displacement are omitted.",
            weight: Weight::Warning,
        });
        self.loading.displacement_mm.truncate(farthest + 1);
        self.loading.force_n.truncate(farthest + 1);
    }
}

fn without_quantities(reason: &QoiError) -> Finding {
    Finding {
        name: "no-quantities",
        value: f64::NAN,
        problem: reason.to_string(),
        help: "Correct the curve or leave the specimen out of the table.",
        weight: Weight::Error,
    }
}

fn sampling(curve: &TestCurve, qois: &Qois, slope_fraction: f64) -> Option<Finding> {
    let peak = qois.displacement_at_peak_mm;
    let before: Vec<f64> = curve.displacement_mm.iter().copied().filter(|u| *u < peak).collect();
    let gap = before.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let in_window = Window::around(slope_fraction, peak).readings(&curve.displacement_mm);
    (before.len() < SPARSE || in_window < 3 || gap > GAP * peak).then(|| Finding {
        name: "sampling",
        value: before.len() as f64,
        problem: format!(
            "has {} readings before its peak, up to {gap:.4} mm apart, {in_window} of them where \
             the slope is taken",
            before.len()
        ),
        help: "Slope and peak are uncertain: record more often.",
        weight: Weight::Warning,
    })
}
