//! Strength that is independent of toughness and regularisation length, as an external driving force of damage.
//!
//! With AT1 and g = (1 − φ)², the damage equation of the model is, without gradient and viscous terms,
//! δ Gc/(c₀ ℓ₀) + g′(φ) ψ H + g(φ) (α₁ I₁ + α₂ √J₂) = 0. ψ, I₁ and J₂ are energy, first invariant and second
//! deviatoric invariant of the undamaged stress. From g = −½ (1 − φ) g′, the equation has the form of all other laws with
//! the driving energy ψ_d = ψ H − ½ √g (α₁ I₁ + α₂ √J₂). In the references, H is 1 for I₁ > 0 and 0 for I₁ < 0. This step
//! changes ψ_d by a jump, and Newton's method does not converge. Here, H rises smoothly between I₁ = −√J₂ and I₁ = √J₂:
//! H = p² (3 − 2p) with p = (1 + I₁/√J₂)/2. Uniaxial states, where |I₁| = √3 √J₂, keep H = 0 or 1. The constants
//! α₁ and α₂ are chosen so that an undamaged point starts to be damaged at the tensile strength in uniaxial tension, and at
//! the hydrostatic strength in hydrostatic tension: a Drucker–Prager strength surface. δ restores the toughness.
//!
//! References: Kumar, Bourdin, Francfort & Lopez-Pamies, J. Mech. Phys. Solids 142 (2020) 104027,
//! doi:10.1016/j.jmps.2020.104027; Larsen, Dolbow & Lopez-Pamies (2024), arXiv:2401.13938.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::Scalar;
use super::response::{Response, packed};
use crate::error::FemError;

/// Strength of a material in tension and compression.
///
/// # Example
/// ```
/// use fem::{Fracture, Material, Strength};
///
/// let graphite = Material::hencky(9800.0, 0.13)
///     .with_fracture(Fracture { residual_stiffness: 1e-4, ..Fracture::new(0.091) })
///     .with_strength(Strength::new(27.0, 77.0));
/// let strength = graphite.strength.expect("graphite has a strength");
/// assert!((strength.hydrostatic_mpa() - 27.72).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Strength {
    /// Uniaxial tensile strength σ_ts, MPa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tensile_mpa: f64,
    /// Uniaxial compressive strength σ_cs, MPa; larger than the tensile strength.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub compressive_mpa: f64,
    /// Distance of neighbouring nodes where cracks run, mm. By default the mean of the whole mesh, which is right for
    /// meshes of uniform size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub node_spacing_mm: Option<f64>,
}

/// Properties of a material and its mesh that the constants of a strength depend on.
#[derive(Clone, Copy, Debug)]
pub struct StrengthContext {
    /// Toughness Gc, N/mm.
    pub toughness_n_per_mm: f64,
    /// Regularisation length ℓ₀, mm.
    pub length_mm: f64,
    /// Young's modulus and bulk modulus, MPa.
    pub young_mpa: f64,
    pub bulk_mpa: f64,
    /// Distance h of neighbouring nodes of the mesh, mm; zero: without the correction for the mesh.
    pub spacing_mm: f64,
}

/// Constants of a strength: of the external driving force, and the factor of the toughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrengthConstants {
    /// Factor δ of the toughness.
    pub toughness_factor: f64,
    /// Coefficients α₁ of I₁ and α₂ of √J₂.
    pub drive: ExternalDrive,
}

/// External driving force α₁ I₁ + α₂ √J₂ of damage, with dimensionless coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExternalDrive {
    pub in_trace: f64,
    pub in_shear: f64,
}

/// Normalising constant c₀ of AT1.
const C0: f64 = 8.0 / 3.0;
/// √J₂ below this share of the stress has no direction; its derivative is taken as zero.
const ROUNDING: f64 = 1e-14;

impl Strength {
    /// Creates a strength for meshes of uniform size.
    pub const fn new(tensile_mpa: f64, compressive_mpa: f64) -> Self {
        Self { tensile_mpa, compressive_mpa, node_spacing_mm: None }
    }

    /// Returns the strength σ_hs in hydrostatic tension of the Drucker–Prager surface, MPa.
    pub fn hydrostatic_mpa(&self) -> f64 {
        let (t, c) = (self.tensile_mpa, self.compressive_mpa);
        2.0 / 3.0 * t * c / (c - t)
    }

    /// Checks that 0 < σ_ts < σ_cs.
    pub(super) fn validate(&self, entity: &str) -> Result<(), FemError> {
        let entity = format!("{entity}.strength");
        let check = |is_valid: bool, field, value, requirement| match is_valid {
            true => Ok(()),
            false => Err(FemError::parameter(&entity, field, value, requirement)),
        };
        let Self { tensile_mpa, compressive_mpa, node_spacing_mm } = *self;
        let is_positive = |x: f64| x > 0.0 && x.is_finite();
        check(is_positive(tensile_mpa), "tensile_mpa", tensile_mpa, "a positive strength in MPa")?;
        check(
            compressive_mpa > tensile_mpa && compressive_mpa.is_finite(),
            "compressive_mpa",
            compressive_mpa,
            "larger than tensile_mpa, in MPa",
        )?;
        let spacing = node_spacing_mm.unwrap_or(1.0);
        check(is_positive(spacing), "node_spacing_mm", spacing, "a positive length in mm")?;
        Ok(())
    }

    /// Returns the largest regularisation length for which the model makes sense, mm: 3 E Gc/(8 σ_ts²), the length at
    /// which AT1 alone has this tensile strength.
    pub fn largest_length_mm(&self, young_mpa: f64, toughness_n_per_mm: f64) -> f64 {
        0.375 * young_mpa * toughness_n_per_mm / self.tensile_mpa.powi(2)
    }

    /// Computes the constants of the damage equation.
    pub fn constants(&self, at: &StrengthContext) -> StrengthConstants {
        let (tensile, hydrostatic) = (self.tensile_mpa, self.hydrostatic_mpa());
        let StrengthContext { toughness_n_per_mm: toughness, length_mm: length, .. } = *at;
        let in_tension = tensile.powi(2) / (2.0 * at.young_mpa);
        let in_hydrostatic = hydrostatic.powi(2) / (2.0 * at.bulk_mpa);
        let root = 3f64.sqrt();
        let ratio =
            (tensile + (1.0 + 2.0 * root) * hydrostatic) / ((8.0 + 3.0 * root) * hydrostatic);
        let first = ratio * 3.0 * toughness / (16.0 * in_tension * length);
        let toughness_factor = if at.spacing_mm > 0.0 {
            // the energy of a crack on a mesh of linear elements is larger by this factor
            let excess = 1.0 + 0.375 * at.spacing_mm / length;
            first / excess.powi(2) + 0.4 / excess
        } else {
            first + 0.375
        };
        let local = toughness_factor * toughness / (8.0 * length);
        let in_trace = -local / hydrostatic + 2.0 * in_hydrostatic / (3.0 * hydrostatic);
        let in_shear = -root * (3.0 * hydrostatic - tensile) * local / (hydrostatic * tensile)
            - 2.0 * in_hydrostatic / (root * hydrostatic)
            + 2.0 * root * in_tension / tensile;
        StrengthConstants { toughness_factor, drive: ExternalDrive { in_trace, in_shear } }
    }

    /// Returns the compressive strength that the model really has for this regularisation length, MPa. It approaches
    /// [`compressive_mpa`](Self::compressive_mpa) as the length becomes small. It is infinite if the model never fails in
    /// uniaxial compression.
    pub fn realised_compressive_mpa(&self, at: &StrengthContext) -> f64 {
        let StrengthConstants { toughness_factor, drive } = self.constants(at);
        let resistance = toughness_factor * at.toughness_n_per_mm / (C0 * at.length_mm);
        let strength = resistance / (drive.in_trace - drive.in_shear / 3f64.sqrt());
        if strength > 0.0 { strength } else { f64::INFINITY }
    }
}

impl ExternalDrive {
    /// Changes the driving energy of a response whose whole energy is degraded: removes the energy of states with a
    /// negative trace of the stress, and adds the external driving force.
    #[inline(always)]
    pub(super) fn add_to<T: Scalar, const TANGENT: bool>(
        self,
        mut out: Response<T>,
        g: T,
    ) -> Response<T> {
        let [zero, half] = [0.0, 0.5].map(|x| g.constant(x));
        let (in_trace, in_shear) = (g.constant(self.in_trace), g.constant(self.in_shear));
        let stress = out.stress_plus;
        let trace = stress[0] + stress[1] + stress[2];
        let mean = g.constant(1.0 / 3.0) * trace;
        let mut deviator = stress;
        let mut squares = zero;
        let mut largest = g.constant(f64::MIN_POSITIVE);
        for i in 0..3 {
            deviator[i] = stress[i] - mean;
            squares = deviator[i].mul_add(deviator[i], squares);
            largest = largest.max(stress[i]).max(zero - stress[i]);
        }
        let root = (half * squares).sqrt();
        let has_shear = (g.constant(ROUNDING) * largest).less_than(root);
        let per_root = T::select(has_shear, half / root.max(largest * ROUNDING), zero);
        let force = in_trace * trace + in_shear * root;
        let part = half * g.sqrt();
        let one = g.constant(1.0);
        let is_compressed = trace.less_than(zero);
        let sided = T::select(is_compressed, zero - one, one);
        let per_shear = T::select(has_shear, one / root.max(largest * ROUNDING), zero);
        let ratio = T::select(has_shear, trace * per_shear, sided).max(zero - one);
        let position = half * (one - (zero - ratio).max(zero - one));
        let share = position * position * (g.constant(3.0) - (position + position));
        let energy = out.driving;
        out.driving_slope = zero - half * part * force / g;
        out.driving = share * energy - part * force;
        if TANGENT {
            let per_g = one / g;
            let share_slope = g.constant(3.0) * position * (one - position) * per_shear * energy;
            for j in 0..3 {
                let mut of_trace = zero;
                let mut of_root = zero;
                for i in 0..3 {
                    let modulus = per_g * out.normal[packed(i.max(j), i.min(j))];
                    of_trace += modulus;
                    of_root = deviator[i].mul_add(modulus, of_root);
                }
                of_root = of_root * per_root;
                let slope = in_trace * of_trace + in_shear * of_root;
                let of_share = share_slope * (of_trace - ratio * of_root);
                out.driving_stress[j] = share * stress[j] + of_share - part * slope;
            }
        }
        out
    }
}
