//! Flow stress of a metal that hardens and depends on the strain rate.

use ppl::prelude::*;

use crate::tension::REFERENCE_STRAIN;

/// Flow stress σ_y = Y₀ r + A (1 − e^(−b α)) at the equivalent plastic strain α: Voce hardening, and the Johnson–Cook rate
/// factor r = 1 + C ln(α̇/ε̇₀) of the yield stress alone, with r = 1 below the reference rate ε̇₀.
///
/// # Reference
/// Voce (1948), J. Inst. Met. 74, 537–562. Johnson & Cook (1983), Proc. 7th Int. Symp. Ballistics, 541–547. The rate
/// factor acts on the yield stress alone in MatCal's example of 304L.
#[derive(Clone, Copy, Debug)]
pub struct VoceJohnsonCook<S> {
    /// Yield stress Y₀ at the reference rate in MPa.
    pub yield_mpa: S,
    /// Rise A of the flow stress at saturation in MPa.
    pub saturation_mpa: S,
    /// Rate b of the hardening.
    pub rate: S,
    /// Rate sensitivity C.
    pub c: S,
    /// Reference rate ε̇₀ in 1/s.
    pub reference_per_s: f64,
}

impl<S: Scalar> VoceJohnsonCook<S> {
    /// Creates a law from the rise of the flow stress up to [`REFERENCE_STRAIN`] in MPa, which replaces the saturation
    /// stress. Tests that do not reach saturation determine the rise and the rate of hardening nearly independently.
    pub fn from_rise(yield_mpa: S, rise_mpa: S, rate: S, c: S, reference_per_s: f64) -> Self {
        let saturation_mpa = -rise_mpa / (-rate * REFERENCE_STRAIN).exp_m1();
        Self { yield_mpa, saturation_mpa, rate, c, reference_per_s }
    }

    /// Rate factor r of the yield stress at a plastic strain rate in 1/s.
    pub fn rate_factor(&self, rate_per_s: f64) -> S {
        self.c * (rate_per_s / self.reference_per_s).ln().max(0.0) + 1.0
    }

    /// Flow stress in MPa at a plastic strain and a plastic strain rate in 1/s.
    pub fn flow_stress_mpa(&self, plastic_strain: f64, rate_per_s: f64) -> S {
        let hardened = -(-self.rate * plastic_strain).exp_m1();
        self.yield_mpa * self.rate_factor(rate_per_s) + self.saturation_mpa * hardened
    }

    /// Strain at which necking begins by Considère's condition dσ/dε = σ at a constant strain rate in 1/s, without the
    /// elastic strain: the solution of A b e^(−b ε) = Y₀ r + A (1 − e^(−b ε)).
    pub fn uniform_strain(&self, rate_per_s: f64) -> S {
        let limit = self.yield_mpa * self.rate_factor(rate_per_s) + self.saturation_mpa;
        (self.saturation_mpa * (self.rate + 1.0) / limit).ln() / self.rate
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

    #[test]
    fn the_rate_factor_is_one_up_to_the_reference_rate() {
        assert_eq!(LAW.rate_factor(1e-7), 1.0);
        assert_eq!(LAW.rate_factor(1e-5), 1.0);
        assert!((LAW.rate_factor(1e-3) - (1.0 + 0.0398 * 100.0_f64.ln())).abs() < 1e-14);
    }

    #[test]
    fn a_law_from_its_rise_rises_by_it() {
        let law = VoceJohnsonCook::from_rise(230.0, 470.0, 1.4, 0.04, 1e-5);
        let rise = law.flow_stress_mpa(0.3, 1e-5) - law.flow_stress_mpa(0.0, 1e-5);
        assert!((rise - 470.0).abs() < 1e-10, "{rise}");
    }

    #[test]
    fn the_largest_load_is_where_considere_says() {
        let load = |strain: f64| LAW.flow_stress_mpa(strain, 2.7e-4) * (-strain).exp();
        let strains = (0..=100_000).map(|i| 1e-5 * f64::from(i));
        let largest = strains.max_by(|a, b| load(*a).total_cmp(&load(*b))).unwrap();
        let strain: f64 = LAW.uniform_strain(2.7e-4);
        assert!((strain - largest).abs() < 1.1e-5, "{strain} {largest}");
    }
}
