//! Elastic laws, splits, degradation functions, crack density, and the equations at an integration point.
//!
//! The equations at a point are written once, generic over the number type ([`Scalar`]): strains ([`Principal`]),
//! stresses and energies of a law ([`Response`]) and its tangent ([`PointTangent`]). The law of a region is a
//! [`RegionLaw`]; a [`LaneLaw`] selects among the laws of a mesh.
//!
//! A new law needs one file in `law/` with its energy ([`HyperelasticLaw`]), or with stress and tangent as in
//! `hencky.rs` and a variant in `region_law.rs`. A new split needs one file in `split/`, a new degradation function
//! one file in `degradation/`. [`assert_material`] tests laws, splits and degradation functions. Users implement the
//! same traits outside the crate.

#[cfg(test)]
#[path = "../../tests/unit/closed_forms.rs"]
mod closed_forms;
mod conformance;
mod crack_density;
mod degradation;
mod inelastic;
#[cfg(test)]
#[path = "../../tests/unit/inelastic.rs"]
mod inelastic_tests;
#[cfg(test)]
#[path = "../../tests/unit/lane_functions.rs"]
mod lane_functions;
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
mod strength;
#[cfg(test)]
#[path = "../../tests/unit/strength.rs"]
mod strength_tests;
mod tangent;
#[cfg(test)]
#[path = "../../tests/unit/laws.rs"]
mod tests;

pub use conformance::assert_material;
pub use crack_density::CrackDensity;
pub use degradation::{DegradationFunction, UserDegradation};
pub use inelastic::{
    Hardening, HardeningPoint, Inelasticity, PlasticRate, Plasticity, PronyModuli, PronyTerm,
    TimeShift, Viscoelasticity, YieldCriterion,
};
pub use law::{
    ConstitutiveLaw, ElasticLaw, Elasticity, HyperelasticLaw, MooneyRivlin, Ogden, OgdenTerm,
    SaintVenantKirchhoff, UserConstitutiveLaw, UserLaw,
};
pub use mixture::Homogenisation;
pub use number::{Number, Scalar};
pub use parameters::{Fracture, Material};
pub use phase_field::{
    DamageEnergies, DamageQuadrature, EnergyKind, EnergySet, Irreversibility, PhaseField,
};
pub use principal::{Principal, Strains};
pub use response::{ElasticResponse, Oblique, Response};
pub use split::{ElasticPoint, EnergySplit, Split, UserSplit};
pub use strain::PrincipalStrain;
pub use strength::{Strength, StrengthContext};

pub use degradation::{Degradation, DegradationLaw};
pub use mixture::{MOST_GRAIN, MixedPhases};
pub use number::{
    Computation, Jet, Lanes, POINTS, REGISTERS, Round, SimdF32, SimdF64, Term, begin, dispatch,
    dot, functions, statements,
};
pub use point::PointMaterial;
pub use point_law::{AtPoint, DrivingHistory, PointLaw};
pub use principal::Inverted;
pub use region_law::{LaneLaw, LawForm, RegionLaw};
pub use response::packed;
pub use split::{Degraded, PointSplit};
pub use strength::ExternalDrive;
pub use tangent::PointTangent;
