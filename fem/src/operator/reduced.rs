//! The tangent of one element in its own barycentric axes and the principal axes of its points.
//!
//! With U_k = ∂u/∂λ_k − ∂u/∂λ_0 (k = 1 … 3), and s_k = Qᵀ F⁻ᵀ ∇λ_k, the gradient of u in the principal
//! axes Q of the strain is h = Σ_k (Qᵀ U_k) ⊗ s_k, whatever the order of the element. The tangent takes
//! it to f_ii = Σ_j D_ij h_jj − τ_i h_ii and f_ij = G_ij (h_ij + h_ji) + τ_j h_ij, and the transpose of
//! the way to h brings f back to the nodes. This is what the matrix-free tangent stores: for each
//! elastic point Q as a quaternion (4), s (9), and times the weight of the point D − τ (6), G (3) and
//! τ (3), 25 numbers against the 45 of the product itself. Where there is damage, the points have
//! also τ⁺ (3); before them come g′ of the damage points and 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l V (6), behind them
//! the local part of the φ block at the damage points, once if it is the same at all of them: the
//! order in which a product reads them.

use std::f64::consts::SQRT_2;

use nalgebra::{Rotation3, UnitQuaternion};

use super::element::Element;
use crate::element::Rule;
use crate::material::Inverted;

/// Where the numbers of a point begin: √2 (x, y, z, w) of Q, s by k, D − τ packed, G, τ, τ⁺.
pub(crate) const ROTATION: usize = 0;
pub(crate) const PUSH: usize = 4;
pub(crate) const NORMAL: usize = 13;
pub(crate) const SHEAR: usize = 19;
pub(crate) const STRESS: usize = 22;
pub(crate) const SOURCE: usize = 25;
/// Entries of the gradient term.
pub(crate) const SLOPES: usize = 6;

/// The points of an integration rule, whatever the number of nodes.
#[derive(Clone, Debug)]
pub(crate) struct ReferenceRule {
    pub(crate) nodes: usize,
    /// λ of the elastic points.
    pub(crate) at: Vec<[f64; 4]>,
    pub(crate) weight: Vec<f64>,
    /// N_a at the damage points.
    pub(crate) damage: Vec<Vec<f64>>,
    /// The share of damage point p in what elastic point q sees.
    pub(crate) mixing: Vec<Vec<f64>>,
    /// Whether all damage points have the same weight and are driven alike.
    pub(crate) alike: bool,
}

impl ReferenceRule {
    pub(crate) fn new<const N: usize>(rule: &Rule<N>) -> Self {
        Self {
            nodes: N,
            at: rule.points.iter().map(|p| p.at).collect(),
            weight: rule.points.iter().map(|p| p.weight).collect(),
            damage: rule.damage.iter().map(|p| p.shape.to_vec()).collect(),
            mixing: rule.mixing.clone(),
            alike: rule.damage.windows(2).all(|p| p[0].weight == p[1].weight)
                && rule.mixing.iter().all(|row| row.windows(2).all(|c| c[0] == c[1])),
        }
    }

    /// Numbers of an elastic point.
    pub(crate) fn point(&self) -> usize {
        if self.damage.is_empty() { SOURCE } else { SOURCE + 3 }
    }

    /// How many numbers there are of g′, of the gradient term, of the elastic points and of the
    /// local part.
    pub(crate) fn lengths(&self) -> [usize; 4] {
        let points = self.point() * self.at.len();
        match self.damage.len() {
            0 => [0, 0, points, 0],
            damage => [damage, SLOPES, points, if self.alike { 1 } else { damage }],
        }
    }

    /// Numbers that an element's tangent takes.
    pub(crate) fn width(&self) -> usize {
        self.lengths().iter().sum()
    }
}

impl<const N: usize> Element<'_, N> {
    /// Writes the reduced tangent in the given form; `coupled` keeps the terms between u and φ.
    pub(crate) fn reduced_tangent(
        &self,
        form: &ReferenceRule,
        coupled: bool,
        out: &mut [f64],
    ) -> Result<(), Inverted> {
        out.fill(0.0);
        let rule = &self.space.rule;
        let [damage_points, gradient, points, _] = form.lengths();
        let (softening, rest) = out.split_at_mut(damage_points);
        let (gradient, rest) = rest.split_at_mut(gradient);
        let (points, local) = rest.split_at_mut(points);
        let slopes = self.space.barycentric(self.tet);
        let phi = self.damage_at_points();
        let mut driving = [0.0; super::element::MOST_POINTS];
        for (q, (point, shape)) in rule.points.iter().zip(self.gradients).enumerate() {
            let weight = self.volume * point.weight;
            let response = self.material.respond(&self.displacement_gradient(shape))?;
            let tangent = response.tangent(self.stiffness_at(q, &phi));
            let out = &mut points[q * form.point()..(q + 1) * form.point()];
            let axes = Rotation3::from_matrix_unchecked(tangent.basis);
            let rotation = UnitQuaternion::from_rotation_matrix(&axes).coords * SQRT_2;
            out[ROTATION..PUSH].copy_from_slice(rotation.as_slice());
            for k in 0..3 {
                let spatial = response.spatial(&slopes[k + 1]);
                out[PUSH + 3 * k..PUSH + 3 * k + 3].copy_from_slice(&spatial);
                for l in 0..=k {
                    let stress = if k == l { tangent.stress[k] } else { 0.0 };
                    out[NORMAL + packed(k, l)] = weight * (tangent.normal[k][l] - stress);
                }
                out[SHEAR + k] = weight * tangent.shear[k];
                out[STRESS + k] = weight * tangent.stress[k];
            }
            if self.material.damage.is_none() {
                continue;
            }
            for (drive, c) in driving.iter_mut().zip(&rule.mixing[q]) {
                *drive += weight * c * self.driving_energy(q, &response);
            }
            if coupled {
                let stress = response.stress_plus();
                (0..3).for_each(|i| out[SOURCE + i] = weight * stress[i]);
            }
        }
        let Some(damage) = &self.material.damage else { return Ok(()) };
        for k in 0..3 {
            for l in 0..=k {
                let product: f64 = (0..3).map(|x| slopes[k + 1][x] * slopes[l + 1][x]).sum();
                gradient[packed(k, l)] = 2.0 * self.volume * damage.gradient * product;
            }
        }
        for (p, point) in rule.damage.iter().enumerate() {
            let [.., curvature] = damage.density.local(phi[p]);
            softening[p] = damage.degradation.slope(phi[p]);
            // the same at all points where there is one place for them
            local[p.min(local.len() - 1)] = damage.degradation.curvature() * driving[p]
                + self.volume
                    * point.weight
                    * (damage.local * curvature + damage.viscosity / self.duration);
        }
        Ok(())
    }
}

/// The principal axes of a point, one after the other.
pub(crate) fn axes(point: &[f64]) -> [[f64; 3]; 3] {
    let [x, y, z, w] = [0, 1, 2, 3].map(|k| point[ROTATION + k]);
    [
        [1.0 - y * y - z * z, x * y + w * z, x * z - w * y],
        [x * y - w * z, 1.0 - x * x - z * z, y * z + w * x],
        [x * z + w * y, y * z - w * x, 1.0 - x * x - y * y],
    ]
}

/// The place of entry (r, s ≤ r) of a symmetric matrix.
#[inline(always)]
pub(crate) const fn packed(r: usize, s: usize) -> usize {
    r * (r + 1) / 2 + s
}
