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
mod region_law;
mod response;
mod split;
mod strain;
mod tangent;
#[cfg(test)]
#[path = "../../tests/unit/laws.rs"]
mod tests;

pub use conformance::assert_material;
pub use crack_density::CrackDensity;
pub use degradation::{DegradationFunction, UserDegradation};
pub use law::{
    ConstitutiveLaw, ElasticLaw, Elasticity, HyperelasticLaw, MooneyRivlin, Ogden, OgdenTerm,
    SaintVenantKirchhoff, UserConstitutiveLaw, UserLaw,
};
pub use mixture::Homogenisation;
pub use number::{Number, Scalar};
pub use parameters::{Fracture, Material};
pub use phase_field::{DamageQuadrature, Irreversibility, PhaseField};
pub use principal::{Principal, Strains};
pub use response::{ElasticResponse, Response};
pub use split::{ElasticPoint, EnergySplit, Split, UserSplit};
pub use strain::PrincipalStrain;

pub use degradation::{Degradation, DegradationLaw};
pub use mixture::{MOST_GRAIN, MixedPhases};
pub use number::{
    Computation, Jet, Lanes, POINTS, REGISTERS, Round, SimdF32, SimdF64, Term, begin, dispatch,
    dot, functions, statements,
};
pub use point::PointMaterial;
pub use point_law::{DrivingHistory, PointLaw};
pub use principal::Inverted;
pub use region_law::{LaneLaw, LawForm, RegionLaw};
pub use response::packed;
pub use split::{Degraded, PointSplit};
pub use tangent::PointTangent;
