//! The tangent of one element in its own barycentric axes, where it needs no gradients.
//!
//! With U_k = ∂u/∂λ_k − ∂u/∂λ_0 (k = 1 … 3) the displacement gradient is Σ_k U_k ⊗ ∇λ_k, so that
//! volume and gradients are absorbed into the 9 × 9 stiffness Ã_kl = w ∂²ψ/∂U_k ∂U_l of a point,
//! whatever the order of the element. This is what the matrix-free tangent stores:
//! for each elastic point Ã (45) and ∂²ψ/∂g ∂U (9), then 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l V (6), then for the
//! damage points g′ and the local part of the φ block.

use nalgebra::Vector3;

use super::element::Element;
use crate::element::Rule;
use crate::material::Inverted;

/// Entries of a symmetric 9 × 9 matrix.
pub(crate) const STIFFNESS: usize = 45;
/// Entries of a point: the stiffness and the coupling.
pub(crate) const POINT: usize = STIFFNESS + 9;
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

    /// Numbers that an element's tangent takes.
    pub(crate) fn width(&self) -> usize {
        POINT * self.at.len() + SLOPES + 2 * self.damage.len()
    }
}

impl<const N: usize> Element<'_, N> {
    /// Writes the reduced tangent; `coupled` keeps the terms between u and φ.
    pub(crate) fn reduced_tangent(&self, coupled: bool, out: &mut [f64]) -> Result<(), Inverted> {
        out.fill(0.0);
        let rule = &self.space.rule;
        let slopes = self.space.barycentric(self.tet);
        let phi = self.damage_at_points();
        let mut driving = [0.0; super::element::MOST_POINTS];
        for (q, (point, shape)) in rule.points.iter().zip(self.gradients).enumerate() {
            let weight = self.volume * point.weight;
            let response = self.material.respond(&self.displacement_gradient(shape))?;
            let tangent = response.tangent(self.stiffness_at(q, &phi));
            let spatial: [[f64; 3]; 3] = std::array::from_fn(|k| response.spatial(&slopes[k + 1]));
            let out = &mut out[q * POINT..(q + 1) * POINT];
            for k in 0..3 {
                for l in 0..=k {
                    let block = tangent.block(&spatial[k], &spatial[l]);
                    for i in 0..3 {
                        for j in 0..if k == l { i + 1 } else { 3 } {
                            out[packed(3 * k + i, 3 * l + j)] = weight * block[(i, j)];
                        }
                    }
                }
            }
            if self.material.damage.is_none() {
                continue;
            }
            for (drive, c) in driving.iter_mut().zip(&rule.mixing[q]) {
                *drive += weight * c * self.driving_energy(q, &response);
            }
            if coupled {
                let stress = response.piola_plus() * weight;
                for k in 0..3 {
                    let force = stress * Vector3::from(slopes[k + 1]);
                    (0..3).for_each(|i| out[STIFFNESS + 3 * k + i] = force[i]);
                }
            }
        }
        let Some(damage) = &self.material.damage else { return Ok(()) };
        let rest = &mut out[rule.points.len() * POINT..];
        for k in 0..3 {
            for l in 0..=k {
                let product: f64 = (0..3).map(|x| slopes[k + 1][x] * slopes[l + 1][x]).sum();
                rest[packed(k, l)] = 2.0 * self.volume * damage.gradient * product;
            }
        }
        let (softening, local) = rest[SLOPES..].split_at_mut(rule.damage.len());
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
