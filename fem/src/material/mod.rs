//! Elastic laws, degradation and crack density; one law a file, parameters with units.

#[cfg(test)]
mod closed_forms;
mod crack_density;
mod degradation;
mod hencky;
mod hencky_many;
mod kinematics;
mod law;
mod many;
mod mooney_rivlin;
mod neo_hookean;
mod ogden;
mod parameters;
mod phase_field;
mod point;
mod principal_many;
mod saint_venant_kirchhoff;
mod strain;
#[cfg(test)]
mod tests;
mod user_law;

pub use crack_density::CrackDensity;
pub use law::Elasticity;
pub use mooney_rivlin::MooneyRivlin;
pub use ogden::Ogden;
pub use parameters::{Fracture, Material};
pub use phase_field::{DamageQuadrature, Irreversibility, PhaseField, Split};
pub use saint_venant_kirchhoff::SaintVenantKirchhoff;
pub use strain::PrincipalStrain;
pub use user_law::{HyperelasticLaw, UserLaw};

pub(crate) use degradation::Degradation;
pub(crate) use hencky_many::{HenckyForm, ResponseMany};
pub(crate) use kinematics::Inverted;
pub(crate) use many::{Many, POINTS, REGISTERS};
pub(crate) use point::{Damage, PointMaterial, PointResponse};
pub(crate) use principal_many::{PrincipalMany, dot};
