//! The tangent of one element in its own barycentric axes and the principal axes of its points.
//!
//! With U_k = ∂u/∂λ_k − ∂u/∂λ_0 (k = 1 … 3), and s_k = Qᵀ F⁻ᵀ ∇λ_k, the gradient of u in the principal
//! axes of the strain is h = Σ_k (Qᵀ U_k) ⊗ s_k, whatever the order of the element. The tangent takes it
//! to f_ii = Σ_j D_ij h_jj − τ_i h_ii and f_ij = G_ij (h_ij + h_ji) + τ_j h_ij, and the transpose of
//! the way to h brings f back to the nodes. This is what the matrix-free tangent stores: for each
//! elastic point Q (9), s (9), D − τ (6), G (3) and τ (3), times the weight of the point, 30 numbers
//! against the 45 of the product itself. Where there is damage, the points have also τ⁺ (3); before
//! them come g′ of the damage points and 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l V (6), behind them the local part of
//! the φ block at the damage points: the order in which a product reads them.

use super::element::Element;
use crate::element::Rule;
use crate::material::Inverted;

/// Where the numbers of a point begin: Q by columns, s by k, D − τ packed, G, τ, τ⁺.
pub(crate) const BASIS: usize = 0;
pub(crate) const PUSH: usize = 9;
pub(crate) const NORMAL: usize = 18;
pub(crate) const SHEAR: usize = 24;
pub(crate) const STRESS: usize = 27;
pub(crate) const SOURCE: usize = 30;
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
}

impl ReferenceRule {
    pub(crate) fn new<const N: usize>(rule: &Rule<N>) -> Self {
        Self {
            nodes: N,
            at: rule.points.iter().map(|p| p.at).collect(),
            weight: rule.points.iter().map(|p| p.weight).collect(),
            damage: rule.damage.iter().map(|p| p.shape.to_vec()).collect(),
            mixing: rule.mixing.clone(),
        }
    }

    /// Numbers of an elastic point.
    pub(crate) fn point(&self) -> usize {
        if self.damage.is_empty() { SOURCE } else { SOURCE + 3 }
    }

    /// How many numbers there are of g′, of the gradient term, of the elastic points and of the
    /// local part.
    pub(crate) fn lengths(&self) -> [usize; 4] {
        let damage = self.damage.len();
        [damage, if damage == 0 { 0 } else { SLOPES }, self.point() * self.at.len(), damage]
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
        let [damage_points, gradient, ..] = form.lengths();
        let (softening, rest) = out.split_at_mut(damage_points);
        let (gradient, rest) = rest.split_at_mut(gradient);
        let (points, local) = rest.split_at_mut(rest.len() - damage_points);
        let slopes = self.space.barycentric(self.tet);
        let phi = self.damage_at_points();
        let mut driving = [0.0; super::element::MOST_POINTS];
        for (q, (point, shape)) in rule.points.iter().zip(self.gradients).enumerate() {
            let weight = self.volume * point.weight;
            let response = self.material.respond(&self.displacement_gradient(shape))?;
            let tangent = response.tangent(self.stiffness_at(q, &phi));
            let out = &mut points[q * form.point()..(q + 1) * form.point()];
            out[BASIS..PUSH].copy_from_slice(tangent.basis.as_slice());
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
            local[p] = damage.degradation.curvature() * driving[p]
                + self.volume
                    * point.weight
                    * (damage.local * curvature + damage.viscosity / self.duration);
        }
        Ok(())
    }
}

/// The place of entry (r, s ≤ r) of a symmetric matrix.
#[inline(always)]
pub(crate) const fn packed(r: usize, s: usize) -> usize {
    r * (r + 1) / 2 + s
}
