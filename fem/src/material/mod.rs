//! Elastic laws, degradation and crack density; one law a file, parameters with units.

mod crack_density;
mod degradation;
mod hencky;
mod kinematics;
mod law;
mod neo_hookean;
mod parameters;
mod phase_field;
mod point;
#[cfg(test)]
mod tests;

pub use crack_density::CrackDensity;
pub use law::ElasticLaw;
pub use parameters::Material;
pub use phase_field::{DamageQuadrature, PhaseField, Split};

pub(crate) use degradation::Degradation;
pub(crate) use kinematics::Inverted;
pub(crate) use point::{Damage, PointMaterial};
