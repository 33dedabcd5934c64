//! Laws with internal variables, added to an elastic law: viscoelasticity and plasticity.
//!
//! The modules, in the order of their layers: parameters (`prony`, `hardening`, `plasticity`), then the responses at a
//! point (`viscous_point`, `viscous_response`, `plastic_point`).
//!
//! References: Simo, Comput. Methods Appl. Mech. Engrg. 60 (1987) 153, doi:10.1016/0045-7825(87)90107-1; Simo, Comput.
//! Methods Appl. Mech. Engrg. 99 (1992) 61, doi:10.1016/0045-7825(92)90123-2.

mod hardening;
mod plastic_point;
mod plasticity;
mod prony;
mod viscous_point;
mod viscous_response;

pub use hardening::{Hardening, HardeningPoint, PlasticRate};
pub(in crate::material) use plastic_point::PlasticPoint;
pub use plasticity::{Plasticity, YieldCriterion};
pub use prony::{PronyModuli, PronyTerm, TimeShift, Viscoelasticity};
pub(in crate::material) use viscous_point::ViscousPoint;
pub(in crate::material) use viscous_response::{DecoupledLaw, ViscousDamage, ViscousIncrement};

/// Inelastic part of a material.
#[derive(Clone, Debug, PartialEq)]
pub enum Inelasticity {
    /// Finite linear viscoelasticity.
    Viscoelastic(Viscoelasticity),
    /// Finite-strain plasticity.
    Plastic(Plasticity),
}

impl Inelasticity {
    /// Returns the law with the Prony terms of the shear modulus in the order of increasing relaxation times, as
    /// mixtures require. The order of the bulk terms has no effect.
    pub(in crate::material) fn sorted(self) -> Self {
        match self {
            Self::Viscoelastic(mut series) => {
                series.shear.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
                Self::Viscoelastic(series)
            }
            Self::Plastic(law) => Self::Plastic(law),
        }
    }

    /// Returns the number of state values of a point.
    pub fn state_len(&self) -> usize {
        match self {
            Self::Viscoelastic(law) => law.state_len(),
            Self::Plastic(_) => plastic_point::STATE,
        }
    }
}
