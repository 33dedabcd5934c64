//! Integrals of stress and energy over an element.

use super::state::ElementState;
use crate::material::{PointLaw, Scalar, dot};

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
    let is_oblique = element.constants.law.is_oblique();
    for q in 0..element.rule.elastic_points.len() {
        let at = element.at::<false>(q, &degradation, scratch);
        sound = sound.min(at.principal.sound);
        // det F⁻¹ as the triple product of the rows of Qᵀ F⁻ᵀ
        let [a, b, c] = at.principal.push;
        let normal =
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let change = one / dot(&normal, &c).abs();
        sums[0] = at.weight.mul_add(at.response.energy, sums[0]);
        sums[1] += at.weight;
        sums[2] = at.weight.mul_add(change, sums[2]);
        for (entry, (i, j)) in ENTRIES.into_iter().enumerate() {
            let (n, m) = (&at.principal.basis[i], &at.principal.basis[j]);
            for k in 0..3 {
                let mut part = at.response.stress[k] * n[k] * m[k];
                if is_oblique {
                    let (p, q) = ((k + 1) % 3, (k + 2) % 3);
                    part += at.response.oblique.stress[k] * (n[p] * m[q] + n[q] * m[p]);
                }
                sums[3 + entry] = at.weight.mul_add(part, sums[3 + entry]);
            }
        }
    }
    (sums, sound)
}
