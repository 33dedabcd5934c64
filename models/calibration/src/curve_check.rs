//! Checks of a measured curve: order and sign of the readings, spikes, preload, toe, unloading, sampling, and branches of
//! a load program.

mod confined;
mod finding;
mod known_program;
mod order;
mod origin;
mod spikes;
#[cfg(test)]
mod tests;
mod times;

use crate::experiment::TestCurve;
use crate::machine::Machine;
use crate::qoi::{QoiError, Qois, Window, noise};
pub use confined::inspect_confined;
use finding::largest;
pub use finding::{Finding, Weight};
use known_program::divided;
pub use known_program::{ProgramLoad, ProgramSegment};
use order::{NOISE_BACK, noise_of_displacement, order, signs};
use origin::{force_zero, late_load, late_onset_mm, preload, toe, toe_mm};
use spikes::spikes;
use times::times;

/// Name of the finding of a curve without slope or peak.
pub const NO_QUANTITIES: &str = "no-quantities";
/// Smallest number of readings before the peak that is not reported as sparse.
const SPARSE: usize = 10;
/// Largest gap between readings before the peak, as a fraction of the displacement at peak; a wider gap is reported.
const GAP: f64 = 0.15;
/// Fewest readings of a loading whose signs are checked.
const FEWEST: usize = 3;

/// Curve with the findings of its checks.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectedCurve {
    /// Findings, in the order of the checks.
    pub findings: Vec<Finding>,
    /// Displacement (mm) at which the force would begin to rise if the curve had no soft start; see
    /// `toe_mm` in `origin.rs`.
    pub toe_mm: f64,
    /// The curve from which quantities are computed, with times from its first reading on: the curve up to its largest
    /// displacement, or with a load program the whole curve with its branches.
    pub prepared: TestCurve,
    /// Displacement (mm) at which loading begins after the approach of the platen or an offset; 0 if loading begins at
    /// the start of the curve or with a soft start.
    onset_mm: f64,
    /// Least standard deviation of the noise of a force, N: a loading with few readings does not show its noise.
    least_noise_n: f64,
}

/// Data for the checks of a curve with a load program.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedProgram {
    /// Segments of the load program in the order of time.
    pub segments: Vec<ProgramSegment>,
    /// Whether a quantity needs the peak of the curve.
    pub needs_peak: bool,
}

impl InspectedCurve {
    /// Checks a curve. The initial slope is computed at `slope_fraction` times the displacement at peak.
    pub fn of(curve: &TestCurve, slope_fraction: f64) -> Self {
        let mut check = Self::unchecked(curve);
        if let Some(finding) = order(curve) {
            check.findings.push(finding);
            return check;
        }
        check.cut_unloading();
        let loading = check.prepared.clone();
        check.inspect_rise(&loading);
        check.inspect_peak(&loading, slope_fraction);
        check
    }

    /// Checks the record of a test with a load program. Hold, unloading and reloading are kept as branches; the checks
    /// concern the first loading. Peak and toe are checked only if a quantity needs the peak.
    ///
    /// The program states the branches and the times of the corners. A corner that the machine reached early or late is
    /// moved to its position in the readings. The prepared curve is the curve of the specimen, without compliance and
    /// force offset of the machine.
    pub fn of_program(
        record: &TestCurve,
        machine: &Machine,
        slope_fraction: f64,
        program: &CheckedProgram,
    ) -> Self {
        let mut check = Self::unchecked(record);
        if let Some(finding) = times(record) {
            check.findings.push(finding);
            return check;
        }
        check.least_noise_n = noise::of_single_readings(&record.time_s, &record.force_n);
        let mut specimen = machine.specimen(&check.prepared);
        // a machine may control the displacement of its crosshead, or of the specimen
        let [by_specimen, by_record] =
            [&specimen, &check.prepared].map(|curve| divided(curve, &program.segments));
        let is_of_record = by_record.misfit < by_specimen.misfit;
        specimen.branches = if is_of_record { by_record } else { by_specimen }.branches;
        check.prepared = specimen;
        let loading = match check.prepared.first_loading() {
            Some(readings) => check.prepared.picked(&readings),
            None => check.prepared.clone(),
        };
        // the order of the readings is not checked: the times state the order, and noise can make displacements
        // decrease
        if loading.force_n.len() >= FEWEST {
            if let Some(finding) = signs(&loading) {
                check.findings.push(finding);
                return check;
            }
            check.inspect_rise(&loading);
        }
        if program.needs_peak {
            check.inspect_peak(&loading, slope_fraction);
        }
        let of_origin =
            |finding: &&mut Finding| ["late-load", "toe", "preload"].contains(&finding.name);
        for finding in check.findings.iter_mut().filter(of_origin) {
            finding.help = "Displacement and time count from the start of loading: subtract both at the start from the \
                            columns of the curve.";
        }
        check
    }

    fn unchecked(curve: &TestCurve) -> Self {
        let mut prepared = TestCurve { branches: Vec::new(), ..curve.clone() };
        let start_s = curve.time_s.first().copied().unwrap_or(0.0);
        prepared.time_s.iter_mut().for_each(|time_s| *time_s -= start_s);
        Self { findings: Vec::new(), toe_mm: 0.0, prepared, onset_mm: 0.0, least_noise_n: 0.0 }
    }

    /// Checks the rising force of a loading.
    fn inspect_rise(&mut self, loading: &TestCurve) {
        self.findings.extend(spikes(loading, self.least_noise_n));
        self.findings.extend(force_zero(loading, self.least_noise_n));
        if let Some(onset_mm) = late_onset_mm(loading, self.least_noise_n) {
            self.findings.push(late_load(onset_mm));
            self.onset_mm = onset_mm;
        }
    }

    /// Checks slope, toe and peak of a loading.
    fn inspect_peak(&mut self, loading: &TestCurve, slope_fraction: f64) {
        let loading = self.after_onset(loading);
        match Qois::of(&loading, slope_fraction) {
            Err(reason) => self.findings.push(without_quantities(&reason)),
            Ok(qois) if qois.slope_n_per_mm <= 0.0 => self.findings.push(Finding {
                name: "slope",
                value: qois.slope_n_per_mm,
                problem: format!("has an initial slope of {:.4} N/mm", qois.slope_n_per_mm),
                help: "Force must rise with displacement in the window of the slope: check the curve, \
                       or slope_fraction.",
                weight: Weight::Error,
            }),
            Ok(qois) => {
                let toe_mm = toe_mm(&loading, &qois, slope_fraction);
                self.toe_mm = self.onset_mm + toe_mm;
                self.findings.extend(preload(&loading, &qois, self.least_noise_n));
                self.findings.push(toe(toe_mm, &qois));
                self.findings.extend(sampling(&loading, &qois, slope_fraction));
            }
        }
    }

    /// Returns the loading branch with displacements measured from the end of the toe, and the value in mm that was
    /// subtracted from the displacements.
    pub fn without_toe(&self, slope_fraction: f64) -> (TestCurve, f64) {
        let mut curve = self.after_onset(&self.prepared);
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
    fn after_onset(&self, loading: &TestCurve) -> TestCurve {
        if self.onset_mm == 0.0 {
            return loading.clone();
        }
        let u = &loading.displacement_mm;
        let start = u.iter().take_while(|u| **u < self.onset_mm).count();
        let readings: Vec<usize> = (start..u.len()).collect();
        loading.picked(&readings).shift_displacement(-self.onset_mm)
    }

    /// Removes the readings after the largest displacement, if displacement decreases by more than noise, and reports
    /// the removal.
    fn cut_unloading(&mut self) {
        let u = &self.prepared.displacement_mm;
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
        let TestCurve { displacement_mm, force_n, time_s, .. } = &mut self.prepared;
        for values in [displacement_mm, force_n, time_s] {
            values.truncate(farthest + 1);
        }
    }
}

fn without_quantities(reason: &QoiError) -> Finding {
    Finding {
        name: NO_QUANTITIES,
        value: f64::NAN,
        problem: reason.to_string(),
        help: "Correct the curve, or remove the specimen from the table.",
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
            "has {} readings before its peak, up to {gap:.4} mm apart, {in_window} of them in \
             the window of the slope",
            before.len()
        ),
        help: "Slope and peak are uncertain: record more often.",
        weight: Weight::Warning,
    })
}
