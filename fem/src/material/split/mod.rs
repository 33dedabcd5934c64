//! Splits of the elastic energy into a part ψ⁺ that damage degrades and a part ψ⁻ that damage does not degrade
//! (spares).
//!
//! A split implements [`EnergySplit`]. A split of this crate needs one file, which also lists the degraded terms of
//! Hencky's energy for mixtures, and one line each in [`Split`], [`Split::shares`], [`Degraded::spares`] and
//! [`Degraded::respond`].

mod shares;
mod spectral;
mod user;
mod volumetric_deviatoric;

pub(super) use shares::Shares;
pub use user::{ElasticPoint, EnergySplit, UserSplit};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::volumetric_deviatoric::VolumetricDeviatoric;
use super::number::Scalar;
use super::principal::Strains;
use super::response::{ElasticResponse, Response};

/// Part ψ⁺ of the elastic energy that damage degrades and that drives damage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// The whole energy: damage grows in tension and in compression alike.
    #[default]
    None,
    /// ψ⁺ = K/2 ⟨tr ε⟩₊² + μ dev ε : dev ε. Cracks still transmit pressure.
    ///
    /// For laws other than Hencky's, ψ⁻ = U(J) for J < 1, where U is the energy of the pure change of volume F =
    /// J^(1/3) I. U is the volumetric term of ψ if there is one, as for Mooney–Rivlin and Ogden. For the neo-Hookean
    /// solid, U = 3μ/2 (J^(2/3) − 1 − ⅔ ln J) + λ/2 (ln J)².
    ///
    /// Reference: Amor, Marigo & Maurini, J. Mech. Phys. Solids 57 (2009) 1209, doi:10.1016/j.jmps.2009.04.011.
    VolumetricDeviatoric,
    /// ψ⁺ = λ/2 ⟨tr ε⟩₊² + μ Σ ⟨ε_i⟩₊²: only extension drives damage. For Hencky's law only.
    ///
    /// Reference: Miehe, Hofacker & Welschinger, Comput. Methods Appl. Mech. Engrg. 199 (2010) 2765,
    /// doi:10.1016/j.cma.2010.04.011, here in logarithmic strains.
    Spectral,
}

impl Split {
    /// Returns whether the terms of Hencky's energy are λ/2 (tr ε)² and μ ε_i², instead of K/2 (tr ε)² and μ dev
    /// ε_i².
    #[inline(always)]
    pub(super) fn is_spectral(self) -> bool {
        self == Split::Spectral
    }

    /// Returns 1 for each term of Hencky's energy that damage degrades, 0 for the other terms.
    #[inline(always)]
    pub(super) fn shares<T: Scalar>(self, strains: &Strains<T>) -> Shares<T> {
        let one = strains.log[0].constant(1.0);
        match self {
            Split::None => Shares { volume: one, principal: [one; 3] },
            Split::VolumetricDeviatoric => volumetric_deviatoric::shares(strains),
            Split::Spectral => spectral::shares(strains),
        }
    }
}

/// Part of the energy that damage degrades in one region.
#[derive(Clone, Debug, PartialEq)]
pub struct Degraded {
    pub split: PointSplit,
    /// Whether the split applies to the driving energy only.
    pub hybrid: bool,
}

/// Split of this crate, or user-defined split.
#[derive(Clone, Debug, PartialEq)]
pub enum PointSplit {
    Standard(Split),
    User(UserSplit),
}

impl Degraded {
    /// Degradation of the whole energy; also used for elastic materials.
    pub const ALL: Self = Self { split: PointSplit::Standard(Split::None), hybrid: false };

    /// Returns whether the split spares a part of the energy at any of the points (lanes). `trace` is tr ε of the
    /// points.
    #[inline(always)]
    pub(super) fn spares<T: Scalar>(&self, trace: T) -> bool {
        match &self.split {
            PointSplit::Standard(Split::VolumetricDeviatoric) => {
                !T::settled(trace.abs().equals(trace))
            }
            // only Hencky's law has a spectral split, which it applies to the terms of its energy
            PointSplit::Standard(Split::None | Split::Spectral) => false,
            PointSplit::User(_) => true,
        }
    }

    /// Returns the response for a degradation g.
    #[inline(always)]
    pub(super) fn respond<T: Scalar>(&self, point: &ElasticPoint<T>, g: T) -> Response<T> {
        let passive = match &self.split {
            PointSplit::Standard(_) => VolumetricDeviatoric.spared(point),
            PointSplit::User(split) => split.spared(point),
        };
        let spared = if self.hybrid { ElasticResponse::zero(g) } else { passive };
        point.response.degraded_without(spared, passive, g)
    }
}
