//! Compliance and load cell of the testing machine.

use crate::experiment::TestCurve;

/// Properties of a testing machine that change its records.
///
/// The machine records the displacement u + C F of the crosshead, where u is the displacement of the specimen's end, F the
/// force on the specimen and C the compliance of frame, platens and load cell, and it records the force F + F₀.
///
/// # Example
/// ```
/// use breccia_calibration::{Machine, TestCurve};
///
/// let machine = Machine { compliance_mm_per_n: 1e-4, force_offset_n: 2.0 };
/// let recorded = TestCurve::new(vec![0.0, 0.02], vec![2.0, 102.0]);
/// let specimen = machine.specimen(&recorded);
/// assert_eq!(specimen.force_n, [0.0, 100.0]);
/// assert!((specimen.displacement_mm[1] - 0.01).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Machine {
    /// Compliance C in mm/N.
    pub compliance_mm_per_n: f64,
    /// Force F₀ in N that the load cell shows without load.
    pub force_offset_n: f64,
}

impl Machine {
    /// Whether the machine is rigid and its load cell is zeroed, so that its records are the curves of the specimens.
    pub fn is_ideal(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the curve of the specimen from a record of the machine.
    pub fn specimen(&self, record: &TestCurve) -> TestCurve {
        if self.is_ideal() {
            return record.clone();
        }
        let force_n: Vec<f64> = record.force_n.iter().map(|f| f - self.force_offset_n).collect();
        let compliance = self.compliance_mm_per_n;
        let readings = record.displacement_mm.iter().zip(&force_n);
        let displacement_mm = readings.map(|(u, force)| u - compliance * force).collect();
        TestCurve { displacement_mm, force_n, ..record.clone() }
    }

    /// Returns the record that the machine writes for the curve of a specimen, the inverse of
    /// [`specimen`](Self::specimen).
    pub fn record(&self, specimen: &TestCurve) -> TestCurve {
        if self.is_ideal() {
            return specimen.clone();
        }
        let readings = specimen.displacement_mm.iter().zip(&specimen.force_n);
        let compliance = self.compliance_mm_per_n;
        let displacement_mm = readings.map(|(u, force)| u + compliance * force).collect();
        let force_n = specimen.force_n.iter().map(|force| force + self.force_offset_n).collect();
        TestCurve { displacement_mm, force_n, ..specimen.clone() }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::qoi::Qois;

    fn viscous() -> TestCurve {
        let displacement_mm: Vec<f64> = (0..=40).map(|i| 0.005 * f64::from(i)).collect();
        let force = |u: &f64| 1500.0 * u * (-(u / 0.12).powi(3) / 3.0).exp();
        let force_n = displacement_mm.iter().map(force).collect();
        TestCurve::new(displacement_mm, force_n)
    }

    #[test]
    fn a_record_is_reduced_to_the_curve_of_its_specimen() {
        let specimen = viscous();
        let machine = Machine { compliance_mm_per_n: 2e-4, force_offset_n: -3.0 };
        let record = machine.record(&specimen);
        let again = machine.specimen(&record);
        for (a, b) in again.displacement_mm.iter().zip(&specimen.displacement_mm) {
            assert!((a - b).abs() < 1e-15, "{a} {b}");
        }
        for (a, b) in again.force_n.iter().zip(&specimen.force_n) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert_eq!(Machine::default().record(&specimen), specimen);
        assert_eq!(Machine::default().specimen(&specimen), specimen);
    }

    /// Compliances in series add: 1/K_record = 1/K + C. The peak force is shifted by the offset, and the displacement at
    /// peak by C F.
    #[test]
    fn springs_in_series_add_their_compliances() {
        let specimen = viscous();
        let machine = Machine { compliance_mm_per_n: 1e-4, force_offset_n: 5.0 };
        let record = machine.record(&specimen);
        let rise = |curve: &TestCurve| {
            (curve.displacement_mm[1] - curve.displacement_mm[0])
                / (curve.force_n[1] - curve.force_n[0])
        };
        assert_relative_eq!(rise(&record), rise(&specimen) + 1e-4, max_relative = 1e-12);
        let [before, after] = [&specimen, &record].map(|curve| Qois::of(curve, 0.3).unwrap());
        assert_relative_eq!(after.peak_force_n, before.peak_force_n + 5.0, max_relative = 1e-4);
        let shifted = before.displacement_at_peak_mm + 1e-4 * before.peak_force_n;
        assert_relative_eq!(after.displacement_at_peak_mm, shifted, max_relative = 2e-3);
    }
}
