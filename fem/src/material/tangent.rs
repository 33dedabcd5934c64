//! The consistent tangent at a point, in the principal axes of the strain (Simo & Hughes, Computational Inelasticity
//! (1998), section 8.4, with the shear term of [`equations`](crate::equations)).
//!
//! With h = ∇δu F⁻¹ in these axes, the stress increment d has the components d_ii = Σ_j D_ij h_jj − τ_i h_ii and d_ij
//! = G_ij (h_ij + h_ji) + h_ij τ_j, where G_ij = ½ (τ_i − τ_j) coth(ε_i − ε_j) − ½ (τ_i + τ_j). Components o of τ
//! outside the principal axes add h o − ⅔ (o tr h + (o : h) I): the increment of dev a for a tensor a that moves with
//! the material.

use super::number::Scalar;
use super::principal::Principal;
use super::response::{Response, packed};

/// Tangent at a point, multiplied by the weight of the point.
#[derive(Clone, Copy, Debug)]
pub struct PointTangent<T> {
    /// Principal axes, one per row.
    pub axes: [[T; 3]; 3],
    /// Symmetric matrix D_ij − δ_ij τ_i, stored by the indices of [`packed`].
    pub normal: [T; 6],
    /// Shear moduli G_ij of the pairs of principal axes; entry k belongs to the pair (i, j) of the
    /// other two axes.
    pub shear: [T; 3],
    /// Principal stresses τ_i.
    pub stress: [T; 3],
    /// Antisymmetric part of D, see [`Response::skew`].
    pub skew: [T; 3],
    /// Components of τ outside the principal axes, see [`Oblique`](super::Oblique).
    pub oblique: [T; 3],
}

impl<T: Scalar> PointTangent<T> {
    /// Creates the tangent of a point, multiplied by `weight`.
    #[inline(always)]
    pub fn new(principal: &Principal<T>, response: &Response<T>, weight: T) -> Self {
        let half = weight.constant(0.5);
        let mut out = Self {
            axes: principal.basis,
            normal: response.normal,
            shear: response.shear,
            stress: response.stress,
            skew: response.skew,
            oblique: response.oblique.stress,
        };
        for i in 0..3 {
            out.stress[i] = weight * response.stress[i];
            out.skew[i] = weight * response.skew[i];
            out.oblique[i] = weight * response.oblique.stress[i];
            for m in 0..3 {
                out.axes[i][m] = principal.basis[m][i];
            }
        }
        for i in 0..3 {
            for j in 0..=i {
                let entry = packed(i, j);
                out.normal[entry] = weight * response.normal[entry];
                if i == j {
                    out.normal[entry] = out.normal[entry] - out.stress[i];
                }
            }
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            out.shear[i] = weight * response.shear[i] - half * (out.stress[j] + out.stress[k]);
        }
        out
    }

    /// Returns the stress increment d, times the weight, for the gradient h = ∇δu F⁻¹; both in the principal axes.
    #[inline(always)]
    pub fn increment(&self, h: &[[T; 3]; 3]) -> [[T; 3]; 3] {
        let mut d = *h;
        let trace = h[0][0] + h[1][1] + h[2][2];
        let mut inclined = trace.constant(0.0);
        let mut slanted = inclined;
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            inclined = self.oblique[k].mul_add(h[i][j] + h[j][i], inclined);
            slanted = self.skew[k].mul_add(h[k][k], slanted);
        }
        let third = trace.constant(-2.0 / 3.0);
        for i in 0..3 {
            d[i][i] = third * inclined + self.skew[i] * trace - slanted;
            for j in 0..3 {
                let normal = self.normal[packed(i.max(j), i.min(j))];
                d[i][i] = normal.mul_add(h[j][j], d[i][i]);
                if i != j {
                    let k = 3 - i - j;
                    let stress = self.stress[j] * h[i][j] + third * trace * self.oblique[k];
                    d[i][j] = self.shear[k].mul_add(h[i][j] + h[j][i], stress);
                }
            }
        }
        // h τ for the components of τ outside the principal axes
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            for row in 0..3 {
                d[row][j] = h[row][i].mul_add(self.oblique[k], d[row][j]);
                d[row][i] = h[row][j].mul_add(self.oblique[k], d[row][i]);
            }
        }
        d
    }
}
