//! Material constants of one region for quadrature points.

use super::crack_density::CrackDensity;
use super::degradation::DegradationLaw;
use super::inelastic::Inelasticity;
use super::law::{Elasticity, Moduli};
use super::number::Scalar;
use super::phase_field::DamageEnergies;
use super::point_law::AtPoint;
use super::principal::Principal;
use super::region_law::{LaneLaw, LawForm, RegionLaw};
use super::response::Response;
use super::split::Degraded;
use super::strength::ExternalDrive;

/// Material constants of one region, in the form used at quadrature points.
#[derive(Clone, Debug)]
pub struct PointMaterial {
    pub elasticity: Elasticity,
    pub moduli: Moduli,
    /// Viscous or plastic part of the law; `None`: the law is elastic, or a user-defined law with a state.
    pub inelastic: Option<Inelasticity>,
    /// Damage constants; `None`: the region stays elastic.
    pub damage: Option<Damage>,
}

/// Damage constants of one region.
#[derive(Clone, Debug)]
pub struct Damage {
    pub degraded: Degraded,
    pub energies: DamageEnergies,
    /// External driving force of a material with a strength of its own.
    pub strength: Option<ExternalDrive>,
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
        let damage = self.damage.as_ref();
        RegionLaw {
            form: self.form(),
            inelastic: self.inelastic.clone(),
            degraded: damage.map_or(Degraded::ALL, |d| d.degraded.clone()),
            energies: damage.map_or_else(DamageEnergies::default, |d| d.energies),
            strength: damage.and_then(|d| d.strength),
        }
    }

    /// Returns whether the tangent is symmetric; true for elastic and user-defined laws.
    ///
    /// The tangent is not symmetric for viscoelastic laws with damage and for plastic flow that is not associated. For
    /// a plastic law with damage, the tangent is not symmetric either if plastic work drives damage and damage does not
    /// degrade the yield stress, or the reverse, or if the plastic work has a threshold. It is not symmetric for a
    /// material with a strength.
    pub fn has_symmetric_tangent(&self) -> bool {
        if let Some(Inelasticity::Plastic(law)) = &self.inelastic {
            let [friction, dilatancy, _] = law.criterion.cone();
            if friction != dilatancy {
                return false;
            }
        }
        if self.damage.as_ref().is_some_and(|damage| damage.strength.is_some()) {
            return false;
        }
        let Some(DamageEnergies { drive, degrade, plastic_threshold_mpa }) =
            self.damage.as_ref().map(|damage| damage.energies)
        else {
            return true;
        };
        match &self.inelastic {
            None => true,
            Some(Inelasticity::Viscoelastic(_)) => false,
            Some(Inelasticity::Plastic(_)) => {
                drive.plastic == degrade.plastic && (!drive.plastic || plastic_threshold_mpa == 0.0)
            }
        }
    }

    /// Returns the response of a law that has no state.
    #[cfg(test)]
    pub(super) fn respond<T: Scalar>(&self, trial: &Principal<T>, g: T) -> Response<T> {
        use super::point_law::PointLaw;
        let laws = [self.law()];
        let moduli = [self.moduli.bulk, self.moduli.shear].map(|x| g.constant(x));
        let law = LaneLaw::new(&laws, g.constant(0.0), moduli, None);
        law.respond::<true>(trial, g, g.constant(1.0), &[], &mut [])
    }

    /// Computes an increment from the state `old` to the displacement gradient h. Returns the trial deformation, the
    /// response with its tangent, and the state at the end. `dt` is the duration in s.
    pub(super) fn increment<T: Scalar>(
        &self,
        h: &[[T; 3]; 3],
        g: T,
        dt: T,
        old: &[T],
    ) -> (Principal<T>, Response<T>, Vec<T>) {
        let laws = [self.law()];
        let moduli = [self.moduli.bulk, self.moduli.shear].map(|x| g.constant(x));
        let law = LaneLaw::new(&laws, g.constant(0.0), moduli, None);
        let mut new = old.to_vec();
        let (trial, response) =
            g.vectorize(AtPoint::<_, _, true> { law: &law, h, g, dt, old, new: &mut new });
        (trial, response, new)
    }
}
