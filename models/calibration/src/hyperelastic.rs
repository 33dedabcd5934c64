//! Rubber elasticity: an example of the calibration of a material law on test curves, to be copied
//! for other laws.
//!
//! A law is defined by the derivatives of its energy with respect to the principal stretches ([`StretchLaw`], about
//! five lines). A calibration is defined by priors and one statement per test point (`model!`, about ten lines). The
//! reference data are Treloar's measurements of vulcanised rubber in three modes of deformation. PSIS-LOO estimates
//! which law predicts new data best:
//!
//! ```no_run
//! use breccia_calibration::hyperelastic::{mooney_rivlin, neo_hookean, ogden, treloar_1944};
//! use ppl::prelude::*;
//!
//! let tests = treloar_1944();
//! let posterior = Nuts::default().seed(1).sample(&mooney_rivlin(&tests))?;
//! println!("{}", posterior.summary());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A law that is valid in every mode of deformation predicts a mode on which it was not calibrated ([`held_out`]). If
//! a law fails this test, the models `…_by_mode` can be used: they give each mode its own moduli, which scatter about
//! shared moduli. This scatter measures the error of the law, and it widens the predictions of a further mode.
//!
//! Run `cargo run --release -p models --example rubber` for the whole comparison.

use ppl::diagnostics::quantile;
use ppl::prelude::*;
use ppl::{Bound, Model, Posterior, SampleError};

/// A mode of deformation of an incompressible sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deformation {
    /// Pulled in one direction.
    Uniaxial,
    /// Pulled equally in two directions.
    Equibiaxial,
    /// Pulled in one direction with the width held constant (planar tension).
    PureShear,
}

impl Deformation {
    /// All modes.
    pub const ALL: [Self; 3] = [Self::Uniaxial, Self::Equibiaxial, Self::PureShear];
}

/// One measured point.
#[derive(Clone, Copy, Debug)]
pub struct StretchTest {
    /// Mode of deformation.
    pub mode: Deformation,
    /// Stretch λ₁ in the direction of pulling.
    pub stretch: f64,
    /// First Piola–Kirchhoff stress P₁₁ in MPa.
    pub stress_mpa: f64,
}

impl Deformation {
    /// Principal stretches (λ₁, λ₂, λ₃) for λ₁ = `stretch`, with λ₁ λ₂ λ₃ = 1. Direction 3 is normal to the free face.
    pub fn stretches(self, stretch: f64) -> [f64; 3] {
        match self {
            Self::Uniaxial => [stretch, stretch.sqrt().recip(), stretch.sqrt().recip()],
            Self::Equibiaxial => [stretch, stretch, stretch.powi(-2)],
            Self::PureShear => [stretch, 1.0, stretch.recip()],
        }
    }
}

/// Incompressible isotropic law, defined by the derivatives ∂W/∂λᵢ of its energy with respect to the principal
/// stretches.
pub trait StretchLaw<S: Scalar> {
    /// ∂W/∂λᵢ at λᵢ = `stretch`, in MPa. A term p/λᵢ with the same p in all directions is a pressure, which has no
    /// effect on the stress.
    fn slope(&self, stretch: f64) -> S;

    /// Nominal stress P₁₁ = ∂W/∂λ₁ − (λ₃/λ₁) ∂W/∂λ₃ in MPa. The pressure follows from the zero stress on the free face
    /// 3 (Ogden 1997, *Non-linear Elastic Deformations*, §7.2).
    fn nominal_stress(&self, mode: Deformation, stretch: f64) -> S {
        let [first, _, third] = mode.stretches(stretch);
        self.slope(first) - self.slope(third) * (third / first)
    }
}

/// W = (μ/2) (Σ λᵢ² − 3).
#[derive(Clone, Copy, Debug)]
pub struct NeoHookeanRubber<S> {
    /// Shear modulus μ in MPa.
    pub shear_mpa: S,
}

impl<S: Scalar> StretchLaw<S> for NeoHookeanRubber<S> {
    fn slope(&self, stretch: f64) -> S {
        self.shear_mpa * stretch
    }
}

/// W = C₁ (Σ λᵢ² − 3) + C₂ (Σ λᵢ⁻² − 3).
#[derive(Clone, Copy, Debug)]
pub struct MooneyRivlinRubber<S> {
    /// C₁ and C₂ in MPa; μ = 2 (C₁ + C₂).
    pub c_mpa: [S; 2],
}

impl<S: Scalar> StretchLaw<S> for MooneyRivlinRubber<S> {
    fn slope(&self, stretch: f64) -> S {
        (self.c_mpa[0] * stretch - self.c_mpa[1] * stretch.powi(-3)) * 2.0
    }
}

/// W = Σₖ (2 mₖ/αₖ²) (Σ λᵢ^αₖ − 3): each term contributes mₖ > 0 to the shear modulus.
///
/// In the usual notation μₖ = 2 mₖ/αₖ (Ogden 1972, Proc. R. Soc. A 326, 565).
#[derive(Clone, Copy, Debug)]
pub struct OgdenRubber<S, const K: usize> {
    /// Contributions mₖ to the shear modulus in MPa.
    pub shear_mpa: [S; K],
    /// Exponents αₖ ≠ 0.
    pub exponent: [S; K],
}

impl<S: Scalar, const K: usize> StretchLaw<S> for OgdenRubber<S, K> {
    fn slope(&self, stretch: f64) -> S {
        let ln = stretch.ln();
        (0..K)
            .map(|k| {
                let alpha = self.exponent[k];
                self.shear_mpa[k] * 2.0 / alpha * ((alpha - 1.0) * ln).exp()
            })
            .sum()
    }
}

ppl::model! {
    /// Calibration of the neo-Hookean law: one modulus, and stresses with the relative scatter `sd` about the law.
    pub fn neo_hookean(tests: &[StretchTest]) {
        let shear_mpa ~ LogNormal(-1.0, 1.0);
        let sd ~ HalfNormal(0.3);
        let law = NeoHookeanRubber { shear_mpa };
        for test in tests {
            let stress = law.nominal_stress(test.mode, test.stretch);
            test.stress_mpa ~ LogNormal(stress.ln(), sd);
        }
    }

    /// Calibration of the Mooney–Rivlin law: two moduli, and stresses with the relative scatter `sd` about the law.
    pub fn mooney_rivlin(tests: &[StretchTest]) {
        let c_mpa ~ LogNormal(-2.0, 1.0).array::<2>();
        let sd ~ HalfNormal(0.3);
        let law = MooneyRivlinRubber { c_mpa };
        for test in tests {
            let stress = law.nominal_stress(test.mode, test.stretch);
            test.stress_mpa ~ LogNormal(stress.ln(), sd);
        }
    }

    /// Calibration of Ogden's law with three terms: a soft term, a stiffening term and a compressive term (α < 0).
    pub fn ogden(tests: &[StretchTest]) {
        let shear_mpa ~ LogNormal(-2.0, 1.5).array::<3>();
        let soft ~ Normal(1.5, 0.5).truncate(0.5..2.5);
        let stiff ~ Normal(5.0, 2.0).truncate(2.5..12.0);
        let compressive ~ Normal(-2.0, 1.0).truncate(-6.0..-0.5);
        let sd ~ HalfNormal(0.3);
        let law = OgdenRubber { shear_mpa, exponent: [soft, stiff, compressive] };
        for test in tests {
            let stress = law.nominal_stress(test.mode, test.stretch);
            test.stress_mpa ~ LogNormal(stress.ln(), sd);
        }
    }

    /// Moduli of one mode of deformation, distributed about the shared moduli with the relative standard deviation
    /// `spread`.
    fn moduli_of_a_mode<const K: usize>(shared_mpa: [Real; K], spread: Real) -> [Real; K] {
        let ln_ratio ~ Normal(0.0, spread).non_centered().array::<K>();
        std::array::from_fn(|k| shared_mpa[k] * ln_ratio[k].exp())
    }

    /// Version of `neo_hookean` with a separate modulus for each mode of deformation.
    pub fn neo_hookean_by_mode(tests: &[StretchTest]) {
        let shear_mpa ~ LogNormal(-1.0, 1.0);
        let spread ~ HalfNormal(0.3);
        let sd ~ HalfNormal(0.3);
        let mut laws = Vec::new();
        for _ in Deformation::ALL {
            let mode_modulus ~ moduli_of_a_mode([shear_mpa], spread);
            laws.push(NeoHookeanRubber { shear_mpa: mode_modulus[0] });
        }
        for test in tests {
            let stress = laws[test.mode as usize].nominal_stress(test.mode, test.stretch);
            test.stress_mpa ~ LogNormal(stress.ln(), sd);
        }
    }

    /// Version of `mooney_rivlin` with separate moduli for each mode of deformation.
    pub fn mooney_rivlin_by_mode(tests: &[StretchTest]) {
        let c_mpa ~ LogNormal(-2.0, 1.0).array::<2>();
        let spread ~ HalfNormal(0.3);
        let sd ~ HalfNormal(0.3);
        let mut laws = Vec::new();
        for _ in Deformation::ALL {
            let mode_moduli ~ moduli_of_a_mode(c_mpa, spread);
            laws.push(MooneyRivlinRubber { c_mpa: mode_moduli });
        }
        for test in tests {
            let stress = laws[test.mode as usize].nominal_stress(test.mode, test.stretch);
            test.stress_mpa ~ LogNormal(stress.ln(), sd);
        }
    }

    /// Version of `ogden` with separate moduli for each mode of deformation and the same exponents for all
    /// modes.
    pub fn ogden_by_mode(tests: &[StretchTest]) {
        let shear_mpa ~ LogNormal(-2.0, 1.5).array::<3>();
        let soft ~ Normal(1.5, 0.5).truncate(0.5..2.5);
        let stiff ~ Normal(5.0, 2.0).truncate(2.5..12.0);
        let compressive ~ Normal(-2.0, 1.0).truncate(-6.0..-0.5);
        let spread ~ HalfNormal(0.3);
        let sd ~ HalfNormal(0.3);
        let mut laws = Vec::new();
        for _ in Deformation::ALL {
            let mode_moduli ~ moduli_of_a_mode(shear_mpa, spread);
            laws.push(OgdenRubber { shear_mpa: mode_moduli, exponent: [soft, stiff, compressive] });
        }
        for test in tests {
            let stress = laws[test.mode as usize].nominal_stress(test.mode, test.stretch);
            test.stress_mpa ~ LogNormal(stress.ln(), sd);
        }
    }
}

/// Accuracy of the predictions of data that were not used for the calibration.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// Log predictive density of a measured point, averaged over the points that were not used; for
    /// stresses in MPa.
    pub ln_density: f64,
    /// Root mean square of ln(median prediction / measured): a relative error.
    pub error: f64,
    /// Predicted stresses in MPa including scatter, one row per draw of the posterior.
    pub predicted: Vec<Vec<f64>>,
    /// Largest R-hat of the calibration.
    pub rhat: f64,
}

/// Calibrates a model to some tests, and predicts other tests. `seen` and `new` are the same model: `seen` has the
/// data of the calibration, and `new` has the data to be predicted.
///
/// # Errors
/// If the models differ, or cannot be sampled.
///
/// # Example
/// ```no_run
/// use breccia_calibration::hyperelastic::{Deformation, held_out, ogden, treloar_1944};
/// use ppl::Nuts;
///
/// let (seen, new): (Vec<_>, Vec<_>) =
///     treloar_1944().into_iter().partition(|test| test.mode != Deformation::Equibiaxial);
/// let result = held_out(&ogden(&seen), &ogden(&new), &Nuts::default().seed(1), 1)?;
/// println!("{:.2} a point, {:.0} %", result.ln_density, 100.0 * result.error);
/// # Ok::<(), ppl::SampleError>(())
/// ```
pub fn held_out<A: Model, B: Model>(
    seen: &Bound<A>,
    new: &Bound<B>,
    sampler: &Nuts<'_>,
    seed: u64,
) -> Result<HeldOut, SampleError> {
    let posterior = sampler.sample(seen)?;
    let rows = posterior.summary().rows;
    let rhat = rows.iter().map(|row| row.rhat).filter(|r| r.is_finite()).fold(1.0, f64::max);
    let predictions = Posterior::from_chains(new, posterior.chains, seed)?;
    let values_and_size = |group: &ppl::Group| {
        let values = group.get("test.stress_mpa");
        values.map_or((Vec::new(), 1), |values| (values.data.clone(), values.size().max(1)))
    };
    let (ln_density, size) = values_and_size(&predictions.log_likelihood);
    let (predicted, _) = values_and_size(&predictions.predictive);
    let (measured, _) = values_and_size(&predictions.observed);
    let draws = (ln_density.len() / size) as f64;
    let column = |data: &[f64], i: usize| -> Vec<f64> {
        data.iter().skip(i).step_by(size).copied().collect()
    };
    let point = |i: usize| ln_sum_exp(&column(&ln_density, i)) - draws.ln();
    let gap = |i: usize| (quantile(&column(&predicted, i), 0.5) / measured[i]).ln();
    let mean = |value: &dyn Fn(usize) -> f64| (0..size).map(value).sum::<f64>() / size as f64;
    Ok(HeldOut {
        ln_density: mean(&point),
        error: mean(&|i| gap(i).powi(2)).sqrt(),
        predicted: predicted.chunks(size).map(<[f64]>::to_vec).collect(),
        rhat,
    })
}

/// Treloar's measurements on 8 % sulphur rubber: uniaxial, equibiaxial and pure shear.
///
/// L. R. G. Treloar (1944), Trans. Faraday Soc. 40, 59–70.
pub fn treloar_1944() -> Vec<StretchTest> {
    include_str!("../../data/treloar_1944.csv").lines().filter_map(parse).collect()
}

fn parse(line: &str) -> Option<StretchTest> {
    let mut fields = line.split(',');
    let mode = match fields.next()? {
        "UT" => Deformation::Uniaxial,
        "ET" => Deformation::Equibiaxial,
        "PS" => Deformation::PureShear,
        _ => return None,
    };
    let stretch = fields.next()?.parse().ok()?;
    let stress_mpa = fields.next()?.parse().ok()?;
    Some(StretchTest { mode, stretch, stress_mpa })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_points_are_read() {
        let readings = treloar_1944();
        let count = |mode| readings.iter().filter(|p| p.mode == mode).count();
        assert_eq!(count(Deformation::Uniaxial), 24);
        assert_eq!(count(Deformation::Equibiaxial), 16);
        assert_eq!(count(Deformation::PureShear), readings.len() - 40);
        assert_eq!(readings[0].stress_mpa, 0.0255);
    }

    /// Textbook stresses of the neo-Hookean law: μ(λ − λ⁻²) uniaxial, μ(λ − λ⁻⁵) equibiaxial, μ(λ − λ⁻³) in pure shear.
    /// The other laws include the neo-Hookean law, and every law has the small-strain slopes 3μ, 6μ and 4μ.
    #[test]
    fn laws_against_closed_forms() {
        let modes = [Deformation::Uniaxial, Deformation::Equibiaxial, Deformation::PureShear];
        for (mode, power, slope) in [(modes[0], -2, 3.0), (modes[1], -5, 6.0), (modes[2], -3, 4.0)]
        {
            let neo = NeoHookeanRubber { shear_mpa: 0.4 };
            for stretch in [0.7f64, 1.0, 1.8, 6.0] {
                let expected = 0.4 * (stretch - stretch.powi(power));
                let by_law: f64 = neo.nominal_stress(mode, stretch);
                approx::assert_relative_eq!(
                    by_law,
                    expected,
                    epsilon = 1e-14,
                    max_relative = 1e-13
                );
                let mooney: f64 =
                    MooneyRivlinRubber { c_mpa: [0.2, 0.0] }.nominal_stress(mode, stretch);
                approx::assert_relative_eq!(
                    mooney,
                    expected,
                    epsilon = 1e-14,
                    max_relative = 1e-13
                );
                let ogden: f64 =
                    OgdenRubber { shear_mpa: [0.4], exponent: [2.0] }.nominal_stress(mode, stretch);
                approx::assert_relative_eq!(ogden, expected, epsilon = 1e-14, max_relative = 1e-13);
            }
            let h = 1e-6;
            let ogden = OgdenRubber { shear_mpa: [0.3, 0.05, 0.05], exponent: [1.3, 5.0, -2.0] };
            let mooney = MooneyRivlinRubber { c_mpa: [0.15, 0.05] };
            let by_ogden: f64 = ogden.nominal_stress(mode, 1.0 + h);
            let by_mooney: f64 = mooney.nominal_stress(mode, 1.0 + h);
            approx::assert_relative_eq!(by_ogden / h, slope * 0.4, max_relative = 1e-5);
            approx::assert_relative_eq!(by_mooney / h, slope * 0.4, max_relative = 1e-5);
        }
    }

    #[test]
    fn gradients_by_mode_are_derivatives() {
        let tests = treloar_1944();
        ppl::check::gradient(&neo_hookean_by_mode(&tests), 1);
        ppl::check::gradient(&mooney_rivlin_by_mode(&tests), 2);
        ppl::check::gradient(&ogden_by_mode(&tests), 3);
    }

    /// The points of a Mooney–Rivlin rubber deviate alternately by ±3 % from the law. The calibrated Mooney–Rivlin law
    /// predicts a further mode with an error of 3 ± 1 %, and with nearly the density of the true law. The neo-Hookean
    /// law with a modulus for each mode has a smaller predictive density.
    #[test]
    fn the_true_law_predicts_the_mode_not_seen() {
        let law = MooneyRivlinRubber { c_mpa: [0.15, 0.08] };
        let point = |mode: Deformation, i: i32| {
            let stretch = 1.1 + 0.15 * f64::from(i);
            let stress: f64 = law.nominal_stress(mode, stretch);
            let off = if i % 2 == 0 { 0.03 } else { -0.03 };
            StretchTest { mode, stretch, stress_mpa: stress * f64::exp(off) }
        };
        let points_of = |mode: Deformation| (0..12).map(move |i| point(mode, i));
        let seen: Vec<StretchTest> =
            points_of(Deformation::Uniaxial).chain(points_of(Deformation::Equibiaxial)).collect();
        let new: Vec<StretchTest> = points_of(Deformation::PureShear).collect();
        let nuts = Nuts::default().chains(2).warmup(400).draws(400).target_accept(0.95).seed(3);
        let right = held_out(&mooney_rivlin(&seen), &mooney_rivlin(&new), &nuts, 1).unwrap();
        // the points deviate from the law by 3 % (root mean square)
        assert!((right.error - 0.03).abs() < 0.01, "{}", right.error);
        let density_of_law = |test: &StretchTest| {
            let stress: f64 = law.nominal_stress(test.mode, test.stretch);
            LogNormal(stress.ln(), 0.03).ln_density(&test.stress_mpa)
        };
        let expected = new.iter().map(density_of_law).sum::<f64>() / 12.0;
        assert!((right.ln_density - expected).abs() < 0.15, "{} {expected}", right.ln_density);
        assert!(right.predicted.len() == 800 && right.predicted[0].len() == 12);
        let by_mode = held_out(&neo_hookean_by_mode(&seen), &neo_hookean_by_mode(&new), &nuts, 1);
        assert!(by_mode.unwrap().ln_density < right.ln_density - 0.5);
    }

    /// Mooney–Rivlin in simple tension: P = 2 (λ − λ⁻²)(C₁ + C₂/λ).
    #[test]
    fn mooney_plot_is_a_line() {
        let law = MooneyRivlinRubber { c_mpa: [0.17, 0.06] };
        for stretch in [1.2f64, 2.0, 4.0] {
            let stress: f64 = law.nominal_stress(Deformation::Uniaxial, stretch);
            let reduced = stress / (2.0 * (stretch - stretch.powi(-2)));
            approx::assert_relative_eq!(reduced, 0.17 + 0.06 / stretch, max_relative = 1e-13);
        }
    }
}
