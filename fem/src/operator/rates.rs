//! Derivatives of the residual of an element with respect to a material parameter, including the derivative
//! of the damage at the start of the increment.
//!
//! The residual is evaluated with the constants below and above the parameter's value, using the same
//! strains, and the difference is kept. This is exact if the residual is linear in the parameter, as in E, Gc,
//! ξ and η of a single phase. Otherwise the error is of second order in the difference of the parameter.

use super::element::{Constants, ElementState, MOST_POINTS};
use crate::material::{PointLaw, Principal, Scalar, dot};

/// Number of parameters whose rates are computed together, using the same strains.
pub(super) const AT_ONCE: usize = 4;

/// A parameter with constants below and above its value, for an element or for one element per lane.
#[derive(Clone, Copy, Debug)]
pub struct Moved<'a, T, L, const N: usize> {
    pub below: Constants<'a, T, L>,
    pub above: Constants<'a, T, L>,
    /// 1 over the difference of the parameter.
    pub per_unit: T,
    /// Whether stress or driving energy differ between `below` and `above`.
    pub responds: bool,
    /// ∂φ_n/∂θ at the nodes.
    pub before: [T; N],
}

/// Four rates per node for each parameter.
pub(super) type Rates<T, const N: usize> = [[[T; 4]; N]; AT_ONCE];

impl<T: Scalar, L: PointLaw<T>, const N: usize> ElementState<'_, T, L, N> {
    /// Adds ∂R/∂θ + ∂R/∂φ_n ∂φ_n/∂θ of the nodes for each parameter. Assumes that the current ψ⁺ drives
    /// damage, without a history. Returns 1, or 0 if the element is inverted.
    #[inline(always)]
    pub fn rates(&self, moved: &[Moved<'_, T, L, N>], out: &mut Rates<T, N>) -> T {
        let zero = self.constant(0.0);
        let phi = self.damage_at_points();
        let damaged = !self.rule.damage.is_empty();
        // g′ Σ w C ψ⁺ at the damage points, difference of `above` and `below`
        let mut force = [[zero; MOST_POINTS]; AT_ONCE];
        let mut sound = self.constant(1.0);
        let mut damage = [[zero]; N];
        for a in 0..N {
            damage[a] = [self.damage[a]];
        }
        for q in 0..self.rule.points.len() {
            let principal = self.principal(q);
            let (weight, barycentric) = (self.weight(q), &self.geometry(q).barycentric);
            sound = sound.min(principal.sound);
            let mut slope = [zero; 3];
            if damaged {
                let change = self.differences(q, &damage);
                for k in 0..3 {
                    for x in 0..3 {
                        slope[x] = change[k][0].mul_add(barycentric[k][x], slope[x]);
                    }
                }
            }
            for (m, moved) in moved.iter().enumerate() {
                let [below, above] = [&moved.below, &moved.above];
                let mut flux = [[zero; 4]; 3];
                if damaged {
                    let stiffness = weight * moved.per_unit * (above.gradient - below.gradient);
                    for k in 0..3 {
                        flux[k][3] = (stiffness + stiffness) * dot(&slope, &barycentric[k]);
                    }
                }
                if moved.responds {
                    // a loop, so that the law is compiled once for both sides
                    let (mut stresses, mut drives) = ([[zero; 3]; 2], [zero; 2]);
                    for side in 0..2 {
                        let constants = if side == 0 { below } else { above };
                        (stresses[side], drives[side]) = self.part(q, &principal, constants, &phi);
                    }
                    let mut stress = stresses[1];
                    for i in 0..3 {
                        stress[i] = stress[i] - stresses[0][i];
                    }
                    let piola = principal.piola(&stress, weight * moved.per_unit);
                    for k in 0..3 {
                        for i in 0..3 {
                            flux[k][i] = dot(&piola[i], &barycentric[k]);
                        }
                    }
                    let shares = if damaged { &self.rule.mixing[q][..] } else { &[] };
                    for (p, &c) in shares.iter().enumerate() {
                        let share = weight * self.constant(c);
                        let drive = above.degradation.slope(phi[p]) * drives[1]
                            - below.degradation.slope(phi[p]) * drives[0];
                        force[m][p] = share.mul_add(drive, force[m][p]);
                    }
                }
                self.add_flux(q, &flux, if damaged { 4 } else { 3 }, &mut out[m]);
            }
        }
        for p in 0..self.rule.damage.len() {
            let shape = self.shape(p);
            let weight = self.damage_weight(p);
            let [_, slope, _] = self.density.local(phi[p]);
            let growth = phi[p] - self.interpolate(&self.before, shape);
            for (m, moved) in moved.iter().enumerate() {
                let [below, above] = [&moved.below, &moved.above];
                let local = (above.local - below.local)
                    .mul_add(slope, (above.viscous - below.viscous) * growth);
                let own = moved.per_unit * weight.mul_add(local, force[m][p]);
                let passed = self.constants.viscous * self.interpolate(&moved.before, shape);
                let rate = own - weight * passed;
                for a in 0..N {
                    if shape[a] != 0.0 {
                        out[m][a][3] = self.constant(shape[a]).mul_add(rate, out[m][a][3]);
                    }
                }
            }
        }
        sound
    }

    /// Stress and driving energy at elastic point q for the given constants.
    #[inline(always)]
    fn part(
        &self,
        q: usize,
        principal: &Principal<T>,
        constants: &Constants<T, L>,
        phi: &[T; MOST_POINTS],
    ) -> ([T; 3], T) {
        let g = self.stiffness_at(q, phi, &constants.degradation);
        let response =
            constants.law.respond::<false>(principal, g, self.constant(0.0), &[], &mut []);
        (response.stress, response.driving)
    }
}
