//! Residual and energies of an element.

use super::state::{ElementState, MOST_POINTS};
use crate::material::{PointLaw, Scalar, dot};

/// Contributions of an element to residual and energies.
#[derive(Clone, Copy, Debug)]
pub struct ElementResidual<T, const N: usize> {
    /// R_u (N) and R_φ (N mm) of the element's nodes.
    pub nodal: [[T; 4]; N],
    /// Part ∫ g′ ψ⁺ N_a dV of R_φ, N mm.
    pub drive: [T; N],
    /// Elastic and crack energy, and energy that damage viscosity and inelastic laws dissipate, N mm.
    pub energies: [T; 3],
    /// 1 if the element is not inverted, else 0.
    pub sound: T,
}

/// Computes the residuals R_u and R_φ of the element's nodes, and the energies. `scratch` is storage for the state of
/// one point.
#[inline(always)]
pub fn residual<T: Scalar, L: PointLaw<T>, const N: usize>(
    element: &ElementState<'_, T, L, N>,
    scratch: &mut [T],
) -> ElementResidual<T, N> {
    let zero = element.constant(0.0);
    let (mut nodal, mut drive) = ([[zero; 4]; N], [zero; N]);
    let [mut elastic, mut fracture, mut viscous] = [zero; 3];
    let mut sound = element.constant(1.0);
    let phi = element.damage_at_points();
    let degradation = element.degradation_at_points(&phi);
    let mut driving = [zero; MOST_POINTS];
    let mut damage = [[zero]; N];
    for a in 0..N {
        damage[a] = [element.damage[a]];
    }
    let is_oblique = element.constants.law.is_oblique();
    for q in 0..element.rule.elastic_points.len() {
        let at = element.at::<false>(q, &degradation, scratch);
        let barycentric = &element.geometry(q).barycentric;
        sound = sound.min(at.principal.sound);
        elastic = at.weight.mul_add(at.response.energy, elastic);
        viscous = at.weight.mul_add(at.response.dissipation, viscous);
        let oblique = is_oblique.then_some(&at.response.oblique.stress);
        let piola = at.principal.piola(&at.response.stress, oblique, at.weight);
        let mut flux = [[zero; 4]; 3];
        for k in 0..3 {
            for i in 0..3 {
                flux[k][i] = dot(&piola[i], &barycentric[k]);
            }
        }
        let damaged = !element.rule.damage.is_empty();
        if damaged {
            element.add_driving(q, &at, &mut driving);
            let mut gradient = [zero; 3];
            let change = element.differences(q, &damage);
            for k in 0..3 {
                for x in 0..3 {
                    gradient[x] = change[k][0].mul_add(barycentric[k][x], gradient[x]);
                }
            }
            let stiffness = at.weight * element.constants.gradient;
            fracture = stiffness.mul_add(dot(&gradient, &gradient), fracture);
            for k in 0..3 {
                flux[k][3] = (stiffness + stiffness) * dot(&gradient, &barycentric[k]);
            }
        }
        element.add_flux(q, &flux, if damaged { 4 } else { 3 }, &mut nodal);
    }
    for p in 0..element.rule.damage.len() {
        let shape = element.shape(p);
        let weight = element.damage_weight(p);
        let [alpha, slope, _] = element.density.local(phi[p]);
        let growth = phi[p] - element.interpolate(&element.before, shape);
        let rate = element.constants.viscous * growth;
        fracture = (weight * element.constants.local).mul_add(alpha, fracture);
        viscous = (weight * rate).mul_add(growth, viscous);
        let [_, degradation_slope, _] = degradation[p];
        let force = degradation_slope * driving[p];
        let local = weight.mul_add(element.constants.local.mul_add(slope, rate), force);
        for a in 0..N {
            if shape[a] != 0.0 {
                let shape = element.constant(shape[a]);
                nodal[a][3] = shape.mul_add(local, nodal[a][3]);
                drive[a] = shape.mul_add(force, drive[a]);
            }
        }
    }
    ElementResidual { nodal, drive, energies: [elastic, fracture, viscous], sound }
}
