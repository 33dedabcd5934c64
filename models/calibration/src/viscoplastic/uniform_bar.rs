//! Tension of a bar that does not neck.

use super::bar_curve::BarCurve;
use super::law::VoceJohnsonCook;

/// Number of Newton iterations for the plastic strain. Three iterations already reach rounding errors, because the
/// elastic stiffness is far larger than the hardening.
const ITERATIONS: usize = 20;

/// A bar that elongates uniformly at a constant engineering strain rate: the exact curve of a bar without taper up to its
/// largest load.
///
/// The Kirchhoff stress is τ = E (ln(1 + e) − α). During plastic flow, τ = σ_y(α, α̇). The engineering stress is τ/(1 +
/// e). The plastic strain rate is the rate of the total logarithmic strain, ė/(1 + e).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformBar {
    /// Young's modulus E in MPa.
    pub young_mpa: f64,
    /// Engineering strain rate ė in 1/s.
    pub rate_per_s: f64,
}

impl UniformBar {
    /// Returns the engineering stress in MPa at an engineering strain.
    pub fn stress_mpa(&self, law: &VoceJohnsonCook<f64>, strain: f64) -> f64 {
        let total = strain.ln_1p();
        let rate_per_s = self.rate_per_s / (1.0 + strain);
        // τ(α) − σ_y(α) falls; if the value at α = 0 is negative, the bar is elastic
        let surplus = |plastic: f64| {
            self.young_mpa * (total - plastic) - law.flow_stress_mpa(plastic, rate_per_s)
        };
        let mut plastic = 0.0;
        if surplus(0.0) > 0.0 {
            for _ in 0..ITERATIONS {
                let hardening = law.saturation_mpa * law.rate * (-law.rate * plastic).exp();
                plastic += surplus(plastic) / (self.young_mpa + hardening);
            }
        }
        self.young_mpa * (total - plastic) / (1.0 + strain)
    }

    /// Returns the curve at some engineering strains.
    ///
    /// # Example
    /// The largest load lies near the strain of Considère's condition:
    /// ```
    /// use breccia_calibration::viscoplastic::{UniformBar, VoceJohnsonCook};
    ///
    /// let law = VoceJohnsonCook {
    ///     yield_mpa: 233.2,
    ///     saturation_mpa: 1101.0,
    ///     rate: 1.946,
    ///     c: 0.0,
    ///     reference_per_s: 1e-5,
    /// };
    /// let bar = UniformBar { young_mpa: 199_950.0, rate_per_s: 2.7e-4 };
    /// let peak = bar.curve(&law, (0..100).map(|k| 0.01 * f64::from(k))).peak()?;
    /// let necking: f64 = law.uniform_strain(2.7e-4);
    /// assert!((peak.strain / necking.exp_m1() - 1.0).abs() < 0.02);
    /// # Ok::<(), breccia_calibration::viscoplastic::BarCurveError>(())
    /// ```
    pub fn curve(
        &self,
        law: &VoceJohnsonCook<f64>,
        strains: impl IntoIterator<Item = f64>,
    ) -> BarCurve {
        let reading = |strain| (strain, self.stress_mpa(law, strain));
        let readings = strains.into_iter().map(reading).collect();
        BarCurve { specimen: "uniform bar".into(), readings }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: VoceJohnsonCook<f64> = VoceJohnsonCook {
        yield_mpa: 233.22,
        saturation_mpa: 1100.94,
        rate: 1.945_57,
        c: 0.0398,
        reference_per_s: 1e-5,
    };
    const BAR: UniformBar = UniformBar { young_mpa: 199_950.0, rate_per_s: 2.7e-4 };

    /// Compares with the backward Euler method with small steps. In this method, the flow stress depends on the rate of
    /// the plastic strain instead of the rate of the whole strain.
    #[test]
    fn the_curve_agrees_with_a_differential_equation() {
        let steps = 20_000;
        let (mut plastic, mut largest) = (0.0_f64, 0.0_f64);
        for k in 1..=steps {
            let strain = 0.6 * f64::from(k) / f64::from(steps);
            let step_s = 0.6 / f64::from(steps) / BAR.rate_per_s;
            let surplus = |added: f64| {
                let stress = BAR.young_mpa * (strain.ln_1p() - plastic - added);
                stress - LAW.flow_stress_mpa(plastic + added, added / step_s)
            };
            if surplus(0.0) > 0.0 {
                // bisection: the surplus decreases as the added plastic strain increases
                let (mut low, mut high) = (0.0, strain.ln_1p() - plastic);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if surplus(middle) > 0.0 { low = middle } else { high = middle }
                }
                plastic += low;
            }
            let exact = BAR.young_mpa * (strain.ln_1p() - plastic) / (1.0 + strain);
            if strain > 0.01 {
                largest = largest.max((BAR.stress_mpa(&LAW, strain) / exact - 1.0).abs());
            }
        }
        println!("largest relative difference {largest:.1e}");
        // the closed form uses the rate of the whole strain instead of the rate of the plastic strain
        assert!(largest < 5e-4, "{largest}");
    }

    #[test]
    fn the_bar_is_elastic_below_its_yield_stress() {
        let stress = BAR.stress_mpa(&LAW, 0.001);
        assert!((stress - 199_950.0 * 0.001_f64.ln_1p() / 1.001).abs() < 1e-9);
    }
}
