//! Integrals of stress and energy over an element.

use super::state::ElementState;
use crate::material::{PointLaw, Scalar};

/// Number of values that [`stress_sums`] returns.
pub(crate) const STRESS_SUMS: usize = 9;
/// Tensor indices of xx, yy, zz, xy, yz, xz: the order of VTK.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Computes integrals over the reference volume: ∫ψ dV, ∫dV, ∫J dV and the entries of ∫τ dV, with τ = J σ. The second
/// value is 1, or 0 if the element is inverted. `scratch` is storage for the state of one point.
#[inline(always)]
pub(crate) fn stress_sums<T: Scalar, L: PointLaw<T>, const N: usize>(
    element: &ElementState<'_, T, L, N>,
    scratch: &mut [T],
) -> ([T; STRESS_SUMS], T) {
    let one = element.constant(1.0);
    let (mut sums, mut sound) = ([element.constant(0.0); STRESS_SUMS], one);
    let degradation = element.degradation_at_points(&element.damage_at_points());
    for q in 0..element.rule.points.len() {
        let at = element.at::<false>(q, &degradation, scratch);
        sound = sound.min(at.principal.sound);
        let [a, b, c] = at.principal.strains.excess;
        let change = ((one + a) * (one + b) * (one + c)).sqrt();
        sums[0] = at.weight.mul_add(at.response.energy, sums[0]);
        sums[1] += at.weight;
        sums[2] = at.weight.mul_add(change, sums[2]);
        for (entry, (i, j)) in ENTRIES.into_iter().enumerate() {
            let (n, m) = (&at.principal.basis[i], &at.principal.basis[j]);
            for k in 0..3 {
                let part = at.response.stress[k] * n[k] * m[k];
                sums[3 + entry] = at.weight.mul_add(part, sums[3 + entry]);
            }
        }
    }
    (sums, sound)
}
