//! Splits of the elastic energy into a part that damage degrades and a part that it spares.
//!
//! A split of this crate is one file with the degraded terms of Hencky's energy, and one line in [`Split`] and in
//! [`Split::shares`]. A split from outside the crate implements [`EnergySplit`].

mod spectral;
mod user;
mod volumetric_deviatoric;

pub use user::{ElasticPoint, EnergySplit, UserSplit};

use serde::{Deserialize, Serialize};

use super::number::Scalar;
use super::principal::Strains;
use super::response::{ElasticResponse, Response};

/// Part ψ⁺ of the elastic energy that damage degrades and that drives damage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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
    /// ψ⁺ = λ/2 ⟨tr ε⟩₊² + μ Σ ⟨ε_i⟩₊²: only extension drives damage.
    ///
    /// Reference: Miehe, Hofacker & Welschinger, Comput. Methods Appl. Mech. Engrg. 199 (2010) 2765,
    /// doi:10.1016/j.cma.2010.04.011, here in logarithmic strains. For Hencky's law only.
    Spectral,
}

/// Shares of the terms of Hencky's energy that damage degrades and that drive damage: one or zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares<T> {
    /// Share of the term in tr ε.
    pub(super) volume: T,
    /// Share of the term of each principal strain.
    pub(super) principal: [T; 3],
}

impl Split {
    /// Whether the terms of Hencky's energy are λ/2 (tr ε)² and μ ε_i², instead of K/2 (tr ε)² and μ dev ε_i².
    #[inline(always)]
    pub(super) fn is_spectral(self) -> bool {
        self == Split::Spectral
    }

    /// Returns the degraded terms of Hencky's energy.
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

/// Split of this crate, or of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum PointSplit {
    Standard(Split),
    User(UserSplit),
}

impl Degraded {
    /// The whole energy is degraded. Also used for elastic materials.
    pub const ALL: Self = Self { split: PointSplit::Standard(Split::None), hybrid: false };

    /// Returns the response for a degradation g. `volumetric` returns U, U′ and U″, the energy of the pure change of
    /// volume that has the point's tr ε.
    #[inline(always)]
    pub(super) fn respond<T: Scalar>(
        &self,
        response: ElasticResponse<T>,
        strains: &Strains<T>,
        moduli: [T; 2],
        volumetric: impl Fn() -> [T; 3],
        g: T,
    ) -> Response<T> {
        let zero = ElasticResponse::zero(g);
        let mut passive = zero;
        match &self.split {
            PointSplit::Standard(Split::VolumetricDeviatoric) => {
                let trace = strains.trace();
                let nowhere_compressed = T::settled(trace.abs().equals(trace));
                if !nowhere_compressed {
                    passive = volumetric_deviatoric::spared(trace, volumetric());
                }
            }
            // no law with this response has a spectral split
            PointSplit::Standard(Split::None | Split::Spectral) => return response.degraded(g),
            PointSplit::User(split) => {
                let point = ElasticPoint::new(strains, response, volumetric(), moduli);
                passive = split.spared(&point);
            }
        }
        let spared = if self.hybrid { zero } else { passive };
        response.degraded_without(spared, passive, g)
    }
}
