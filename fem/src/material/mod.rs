//! Elastic laws, degradation, crack density, and the equations at a quadrature point.
//!
//! The equations at a point are written once over a [`Scalar`]: strains ([`Principal`]), stresses and energies of a
//! law ([`Response`]) and its tangent ([`PointTangent`]). A new law is one file that contains its energy
//! ([`HyperelasticLaw`]). If that is not fast enough, the file contains the derivatives of the energy, as in
//! `hencky.rs`, and `law.rs` and `point.rs` get one line each. [`assert_material`] tests both kinds of laws.

#[cfg(test)]
#[path = "../../tests/unit/closed_forms.rs"]
mod closed_forms;
mod conformance;
mod crack_density;
mod degradation;
mod law;
mod mixture;
mod number;
mod parameters;
mod phase_field;
mod point;
mod point_law;
mod principal;
mod response;
mod strain;
mod tangent;
#[cfg(test)]
#[path = "../../tests/unit/laws.rs"]
mod tests;

pub use conformance::assert_material;
pub use crack_density::CrackDensity;
pub use law::{
    ElasticLaw, Elasticity, HyperelasticLaw, MooneyRivlin, Ogden, OgdenTerm, SaintVenantKirchhoff,
    UserLaw,
};
pub use mixture::Homogenisation;
pub use parameters::{Fracture, Material};
pub use phase_field::{DamageQuadrature, Irreversibility, PhaseField, Split};
pub use strain::PrincipalStrain;

pub use degradation::Degradation;
pub use mixture::{MOST_GRAIN, MixedPhases};
pub use number::{
    Lanes, Number, POINTS, REGISTERS, Round, Scalar, SimdF32, SimdF64, Term, begin, dispatch, dot,
    functions, statements,
};
pub use point::{Degraded, Formula, FormulaLaw, LaneLaw, PointMaterial};
pub use point_law::{DrivingHistory, PointLaw};
pub use principal::{Inverted, Principal};
pub use response::{Response, packed};
pub use tangent::PointTangent;
