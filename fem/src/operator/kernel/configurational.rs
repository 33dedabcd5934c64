//! Configurational forces of an element.

use super::state::ElementState;
use crate::material::{PointLaw, Scalar, dot};

/// Computes the configurational forces ∫ (ψ I − Hᵀ P) ∇N_a dV of the element's nodes, N. ψ is the elastic energy
/// density, H the displacement gradient and P the nominal stress; the fourth entry of each node is zero. The second value
/// is 1, or 0 if the element is inverted. `scratch` is storage for the state of one point.
#[inline(always)]
pub(crate) fn configurational<T: Scalar, L: PointLaw<T>, const N: usize>(
    element: &ElementState<'_, T, L, N>,
    scratch: &mut [T],
) -> ([[T; 4]; N], T) {
    let zero = element.constant(0.0);
    let (mut nodal, mut sound) = ([[zero; 4]; N], element.constant(1.0));
    let degradation = element.degradation_at_points(&element.damage_at_points());
    let is_oblique = element.constants.law.is_oblique();
    for q in 0..element.rule.elastic_points.len() {
        let at = element.at::<false>(q, &degradation, scratch);
        sound = sound.min(at.principal.sound);
        let oblique = is_oblique.then_some(&at.response.oblique.stress);
        let piola = at.principal.piola(&at.response.stress, oblique, at.weight);
        let h = element.displacement_gradient(q);
        let energy = at.weight * at.response.energy;
        let barycentric = &element.geometry(q).barycentric;
        let mut flux = [[zero; 4]; 3];
        for k in 0..3 {
            let slope = &barycentric[k];
            let traction = [dot(&piola[0], slope), dot(&piola[1], slope), dot(&piola[2], slope)];
            for j in 0..3 {
                let column = [h[0][j], h[1][j], h[2][j]];
                flux[k][j] = energy * slope[j] - dot(&column, &traction);
            }
        }
        element.add_flux(q, &flux, 3, &mut nodal);
    }
    (nodal, sound)
}
