//! Laws of isotropic hardening.

use ppl::prelude::*;

/// Plastic strain up to which the rise of the stress is a parameter of both laws. This strain is in the middle of the
/// tested range, where the data determine the rise best and nearly independently of the shape of the curve.
pub const REFERENCE_STRAIN: f64 = 0.3;

/// Flow stress as a function of plastic strain, with three positive parameters: stress at yield, rise of the stress up
/// to [`REFERENCE_STRAIN`], and a shape parameter.
///
/// The logarithms of the parameters are normally distributed between specimens, so that scatter is relative.
pub trait HardeningLaw: Sync {
    /// Names of the parameters, including units.
    const PARAMETERS: [&'static str; 3];
    /// Mean and standard deviation of the normal prior of the logarithm of each parameter.
    const LN_PRIOR: [[f64; 2]; 3];

    /// Flow stress σ(ε_p) in MPa.
    fn stress_mpa<S: Scalar>(parameters: &[S; 3], plastic_strain: f64) -> S;

    /// Strain at which necking begins by Considère's criterion dσ/dε = σ, in closed form, without the elastic strain.
    fn uniform_strain<S: Scalar>(parameters: &[S; 3]) -> S;
}

/// σ = σ_y + Q (1 − e^(−b ε_p)): hardening saturates. The parameter is the rise Q (1 − e^(−0.3 b)) instead of Q.
///
/// # Reference
/// Voce (1948), J. Inst. Met. 74, 537–562.
#[derive(Clone, Copy, Debug)]
pub struct Voce;

impl HardeningLaw for Voce {
    const PARAMETERS: [&'static str; 3] = ["yield_mpa", "rise_mpa", "rate"];
    // medians of 250 MPa, 500 MPa and 3, for an annealed austenitic steel
    const LN_PRIOR: [[f64; 2]; 3] = [[5.5, 0.5], [6.2, 0.5], [1.1, 1.0]];

    fn stress_mpa<S: Scalar>(&[yielding, rise, rate]: &[S; 3], plastic_strain: f64) -> S {
        let part = (-rate * plastic_strain).exp_m1() / (-rate * REFERENCE_STRAIN).exp_m1();
        yielding + rise * part
    }

    /// Solution of Considère's criterion for Voce's law, Q b e^(−b ε) = σ_y + Q − Q e^(−b ε).
    fn uniform_strain<S: Scalar>(&[yielding, rise, rate]: &[S; 3]) -> S {
        let saturation = -rise / (-rate * REFERENCE_STRAIN).exp_m1();
        (saturation * (rate + 1.0) / (yielding + saturation)).ln() / rate
    }
}

/// σ = K (ε₀ + ε_p)^n: hardening does not saturate. The parameters are σ_y = K ε₀^n and the rise K (ε₀ + 0.3)^n −
/// σ_y, instead of K and ε₀.
///
/// # Reference
/// Swift (1952), J. Mech. Phys. Solids 1, 1–18, doi:10.1016/0022-5096(52)90002-1.
#[derive(Clone, Copy, Debug)]
pub struct Swift;

impl Swift {
    /// Prestrain ε₀ = 0.3/((1 + rise/σ_y)^(1/n) − 1).
    fn prestrain<S: Scalar>(&[yielding, rise, exponent]: &[S; 3]) -> S {
        (((rise / yielding).ln_1p() / exponent).exp_m1() / REFERENCE_STRAIN).recip()
    }
}

impl HardeningLaw for Swift {
    const PARAMETERS: [&'static str; 3] = ["yield_mpa", "rise_mpa", "exponent"];
    // medians of 250 MPa, 500 MPa and 0.5
    const LN_PRIOR: [[f64; 2]; 3] = [[5.5, 0.5], [6.2, 0.5], [-0.7, 0.5]];

    fn stress_mpa<S: Scalar>(parameters: &[S; 3], plastic_strain: f64) -> S {
        let ratio = Self::prestrain(parameters).recip() * plastic_strain;
        parameters[0] * (ratio.ln_1p() * parameters[2]).exp()
    }

    /// Solution of Considère's criterion for Swift's law, n/(ε₀ + ε) = 1.
    fn uniform_strain<S: Scalar>(parameters: &[S; 3]) -> S {
        parameters[2] - Self::prestrain(parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that the engineering stress σ(ε) e^(−ε) has its maximum at the strain of Considère's criterion.
    fn assert_necks<L: HardeningLaw>(parameters: [f64; 3]) {
        let load = |strain: f64| L::stress_mpa(&parameters, strain) * (-strain).exp();
        let strains = (0..=100_000).map(|i| 1e-5 * f64::from(i));
        let largest = strains.max_by(|a, b| load(*a).total_cmp(&load(*b))).unwrap();
        let computed: f64 = L::uniform_strain(&parameters);
        assert!((computed - largest).abs() < 1.1e-5, "{computed} {largest}");
    }

    #[test]
    fn the_largest_load_is_where_considere_says() {
        assert_necks::<Voce>([260.0, 450.0, 2.5]);
        assert_necks::<Voce>([400.0, 250.0, 12.0]);
        assert_necks::<Swift>([260.0, 500.0, 0.55]);
        assert_necks::<Swift>([200.0, 300.0, 0.2]);
    }

    /// Compares with the laws in their usual parameters: 260 + 900 (1 − e^(−2.5 ε)) and 1400 (0.05 + ε)^0.5.
    #[test]
    fn laws_are_those_of_their_references() {
        let voce = |strain: f64| 260.0 + 900.0 * (1.0 - (-2.5 * strain).exp());
        let swift = |strain: f64| 1400.0 * (0.05 + strain).sqrt();
        let parameters_of =
            |law: &dyn Fn(f64) -> f64, shape: f64| [law(0.0), law(0.3) - law(0.0), shape];
        for strain in [0.0, 0.01, 0.2, 0.6] {
            let stress: f64 = Voce::stress_mpa(&parameters_of(&voce, 2.5), strain);
            approx::assert_relative_eq!(stress, voce(strain), max_relative = 1e-13);
            let stress: f64 = Swift::stress_mpa(&parameters_of(&swift, 0.5), strain);
            approx::assert_relative_eq!(stress, swift(strain), max_relative = 1e-13);
        }
    }
}
