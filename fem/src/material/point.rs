//! Material constants of one region for quadrature points.

use super::crack_density::CrackDensity;
use super::degradation::DegradationLaw;
use super::law::{Elasticity, Moduli};
use super::number::Scalar;
use super::point_law::PointLaw;
use super::principal::Principal;
use super::region_law::{LaneLaw, LawForm, RegionLaw};
use super::response::Response;
use super::split::Degraded;

/// Material constants of one region, in the form used at quadrature points.
#[derive(Clone, Debug)]
pub struct PointMaterial {
    pub elasticity: Elasticity,
    pub moduli: Moduli,
    /// Damage constants; `None`: the region stays elastic.
    pub damage: Option<Damage>,
}

/// Damage constants of one region.
#[derive(Clone, Debug)]
pub struct Damage {
    pub degraded: Degraded,
    pub degradation: DegradationLaw,
    pub density: CrackDensity,
    /// Whether the largest driving energy so far drives damage.
    pub history: bool,
    /// Residual stiffness η.
    pub residual: f64,
    /// Coefficient Gc/(c₀ ℓ₀) of the local crack density α(φ), MPa.
    pub local: f64,
    /// Coefficient Gc ℓ₀/c₀ of |∇φ|², N.
    pub gradient: f64,
    /// Viscosity ξ, MPa s.
    pub viscosity: f64,
}

impl PointMaterial {
    /// Returns the form of the law.
    pub fn form(&self) -> LawForm {
        LawForm::new(&self.elasticity)
    }

    /// Returns the law of the region. In a region without damage, the whole energy counts as degraded.
    pub fn law(&self) -> RegionLaw {
        let degraded = self.damage.as_ref().map_or(Degraded::ALL, |d| d.degraded.clone());
        RegionLaw { form: self.form(), degraded }
    }

    /// Returns the response (with tangent) and the state after an increment of one second that starts at the state
    /// zero.
    pub(super) fn increment<T: Scalar>(&self, trial: &Principal<T>, g: T) -> (Response<T>, Vec<T>) {
        let laws = [self.law()];
        let moduli = [self.moduli.bulk, self.moduli.shear].map(|x| g.constant(x));
        let law = LaneLaw::new(&laws, g.constant(0.0), moduli, None);
        let (old, mut new) = (vec![g.constant(0.0); law.state_len()], vec![g; law.state_len()]);
        (law.respond::<true>(trial, g, g.constant(1.0), &old, &mut new), new)
    }
}
