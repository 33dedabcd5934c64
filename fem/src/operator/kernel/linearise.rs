//! Linearisation of an element: computation of the stored data of the tangent.

use super::point_data::{DataLayout, rotation};
use super::state::{ElementState, MOST_POINTS};
use crate::material::{PointLaw, PointTangent, Response, Scalar, dot, packed};

/// Writes the stored data of the element's tangent in the order of [`DataLayout`]. `coupled` includes the coupling
/// terms between u and φ. With `AXES` the principal axes are appended, and the quaternions are not written.
/// `scratch` is storage for the state of one point. Returns 1, or 0 if the element is inverted.
#[inline(always)]
pub fn linearise<T: Scalar, L: PointLaw<T>, const AXES: bool, const N: usize>(
    element: &ElementState<'_, T, L, N>,
    coupled: bool,
    data: &mut [T],
    scratch: &mut [T],
) -> T {
    let zero = element.constant(0.0);
    let layout = DataLayout::new(element.rule, element.plain);
    let phi = element.damage_at_points();
    let degradation = element.degradation_at_points(&phi);
    let has_damage = !element.rule.damage.is_empty();
    let mut sound = element.constant(1.0);
    let mut driving = [zero; MOST_POINTS];
    for q in 0..element.rule.elastic_points.len() {
        let at = element.at::<true>(q, &degradation, scratch);
        let barycentric = &element.geometry(q).barycentric;
        sound = sound.min(at.principal.sound);
        let tangent = PointTangent::new(&at.principal, &at.response, at.weight);
        if AXES {
            layout.axes_mut(q, data).copy_from_slice(tangent.axes.as_flattened());
        }
        let point = layout.point_mut(q, data);
        if !AXES {
            *point.rotation = rotation(&tangent.axes);
        }
        for k in 0..3 {
            for i in 0..3 {
                point.push[3 * k + i] = dot(&at.principal.push[i], &barycentric[k]);
            }
        }
        *point.normal = tangent.normal;
        *point.shear = tangent.shear;
        *point.stress = tangent.stress;
        if let Some(source) = point.source {
            for i in 0..3 {
                source[i] = if coupled { at.weight * at.response.stress_plus[i] } else { zero };
            }
        }
        if let Some([driving_slope]) = point.driving_slope {
            *driving_slope = at.weight * at.response.driving_slope;
        }
        if let Some(extra) = layout.extra_mut(q, data) {
            let Response { driving_stress, skew, oblique, .. } = &at.response;
            let coupling = if coupled { at.weight } else { zero };
            for k in 0..3 {
                extra[k] = at.weight * oblique.stress[k];
                extra[3 + k] = coupling * oblique.stress_plus[k];
                extra[6 + k] = coupling * driving_stress[k];
                extra[9 + k] = coupling * oblique.driving_stress[k];
                extra[12 + k] = at.weight * skew[k];
            }
        }
        let mut gradient = layout.point_mut(q, data).gradient;
        let mut volume = at.weight;
        if element.plain && has_damage && q == 0 {
            gradient = Some(layout.shared_gradient_mut(data));
            volume = element.geometry(q).volume;
        }
        if let Some(gradient) = gradient {
            let stiffness = volume * (element.constants.gradient + element.constants.gradient);
            for k in 0..3 {
                for l in 0..=k {
                    gradient[packed(k, l)] = stiffness * dot(&barycentric[k], &barycentric[l]);
                }
            }
        }
        if has_damage {
            element.add_driving(q, &at, &mut driving);
        }
    }
    for p in 0..element.rule.damage.len() {
        let [_, slope, degradation_curvature] = degradation[p];
        layout.degradation_slopes_mut(data)[p] = slope;
        // local part: g″ Σ w ψ⁺ + w (Gc/(c₀ ℓ₀) α″ + ξ/Δt)
        let [.., curvature] = element.density.local(phi[p]);
        let stiffness = element.constants.local.mul_add(curvature, element.constants.viscous);
        let weight = element.damage_weight(p);
        *layout.local_mut(p, data) = degradation_curvature.mul_add(driving[p], weight * stiffness);
    }
    sound
}
