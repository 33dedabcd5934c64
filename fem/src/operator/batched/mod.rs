//! Several elements at once: residual, tangent blocks and reduced tangent of Hencky solids.
//!
//! The formulas are those of [`super::element`], with a lane for each element. A region without
//! damage is one whose damage neither softens nor costs anything: η = 1 and no toughness.

mod elements;
mod reduced;
mod residual;
mod tangent;
#[cfg(test)]
mod tests;

use reduced::Reduced;
use residual::Residuals;
use tangent::Tangents;

use super::element::{Block, ElementResidual};
use super::lanes::{LANES, dispatch, places};
use super::reduced::ReferenceRule;
use super::residual::Increment;
use crate::element::Space;
use crate::material::{CrackDensity, HenckyForm, Inverted, PointMaterial};

/// What the elements of a mesh have in common in an increment.
pub(super) struct Batched<'a, const N: usize> {
    space: &'a Space<N>,
    increment: &'a Increment<'a>,
    form: HenckyForm,
    density: CrackDensity,
    /// By region.
    constants: Vec<Constants>,
    places: [usize; LANES],
}

/// κ, μ, η, Gc/(c₀ ℓ₀), Gc ℓ₀/c₀ and ξ/Δt of a region.
type Constants = [f64; 6];

impl<'a, const N: usize> Batched<'a, N> {
    /// `None`: these materials are for single points.
    pub(super) fn new(space: &'a Space<N>, increment: &'a Increment<'a>) -> Option<Self> {
        let form = HenckyForm::of(increment.materials)?;
        let damaged = || increment.materials.iter().filter_map(|m| m.damage.as_ref());
        let density = damaged().next().map_or(CrackDensity::At2, |d| d.density);
        if damaged().any(|d| d.density != density) {
            return None;
        }
        let constants = |material: &PointMaterial| {
            let [volumetric, shear] = form.moduli(material);
            let [residual, local, gradient, viscosity] = match &material.damage {
                Some(d) => [d.degradation.residual, d.local, d.gradient, d.viscosity],
                None => [1.0, 0.0, 0.0, 0.0],
            };
            [volumetric, shear, residual, local, gradient, viscosity / increment.span.duration]
        };
        let constants = increment.materials.iter().map(constants).collect();
        Some(Self { space, increment, form, density, constants, places: places::<f64>() })
    }

    /// The residuals of the elements from `first` on.
    pub(super) fn residuals(
        &self,
        first: usize,
        out: &mut [ElementResidual<N>],
    ) -> Result<(), Inverted> {
        dispatch(Residuals { batched: self, first, out })
    }

    /// The tangents of the elements from `first` on.
    pub(super) fn tangents(
        &self,
        first: usize,
        coupled: bool,
        out: &mut [[[Block; N]; N]],
    ) -> Result<(), Inverted> {
        dispatch(Tangents { batched: self, first, coupled, out })
    }

    /// The reduced tangents of these elements, in the form of the space's rule: number by number.
    pub(super) fn reduced(
        &self,
        tets: [usize; LANES],
        coupled: bool,
        form: &ReferenceRule,
        out: &mut [[f64; LANES]],
    ) -> Result<(), Inverted> {
        dispatch(Reduced { batched: self, tets, coupled, form, out })
    }

    /// The element of each lane, so that the rows that are written back have the order of the
    /// elements; lanes without one have the last one again.
    fn rows(&self, first: usize, count: usize) -> [usize; LANES] {
        let mut tets = [first; LANES];
        for row in 0..LANES {
            tets[self.places[row]] = first + row.min(count - 1);
        }
        tets
    }
}
