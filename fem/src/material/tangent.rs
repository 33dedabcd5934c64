//! The consistent tangent at a point, in the principal axes of the strain (Simo & Hughes, Computational Inelasticity
//! (1998), section 8.4, with the shear term of [`equations`](crate::equations)).
//!
//! With h = ∇δu F⁻¹ in these axes, the stress increment d has the components d_ii = Σ_j D_ij h_jj − τ_i h_ii and d_ij
//! = G_ij (h_ij + h_ji) + h_ij τ_j, where G_ij = ½ (τ_i − τ_j) coth(ε_i − ε_j) − ½ (τ_i + τ_j).

use super::number::{Scalar, dot};
use super::principal::Principal;
use super::response::{Response, packed};

/// Tangent at a point, multiplied by the weight of the point.
#[derive(Clone, Copy, Debug)]
pub struct PointTangent<T> {
    /// Principal axes, one per row.
    pub axes: [[T; 3]; 3],
    /// D_ij − δ_ij τ_i, with indices by [`packed`].
    pub normal: [T; 6],
    /// G_ij; entry k belongs to the pair (i, j) of the other two axes.
    pub shear: [T; 3],
    /// Principal stresses τ_i.
    pub stress: [T; 3],
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
        };
        for i in 0..3 {
            out.stress[i] = weight * response.stress[i];
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

    /// Returns the 3 × 3 block ∂R_a/∂u_b in global axes, for two spatial gradients a and b in the principal basis. In
    /// the principal basis, the block is K_ij = δ_ij Σ_l A_il a_l b_l + (1 − δ_ij)(D_ij a_i b_j + G_ij a_j b_i), with
    /// A_ii = D_ii − τ_i and A_il = G_il + τ_l.
    #[inline(always)]
    pub fn block(&self, a: &[T; 3], b: &[T; 3]) -> [[T; 3]; 3] {
        let products = [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
        let mut local = [*a; 3];
        for i in 0..3 {
            let mut diagonal = self.normal[packed(i, i)] * products[i];
            for j in 0..3 {
                if i != j {
                    let shear = self.shear[3 - i - j];
                    diagonal = (shear + self.stress[j]).mul_add(products[j], diagonal);
                    let (r, s) = if i > j { (i, j) } else { (j, i) };
                    let normal = self.normal[packed(r, s)] * a[i];
                    local[i][j] = normal.mul_add(b[j], shear * a[j] * b[i]);
                }
            }
            local[i][i] = diagonal;
        }
        let mut turned = local;
        for i in 0..3 {
            for n in 0..3 {
                let column = [self.axes[0][n], self.axes[1][n], self.axes[2][n]];
                turned[i][n] = dot(&local[i], &column);
            }
        }
        let mut out = turned;
        for n in 0..3 {
            let column = self.turn(&[turned[0][n], turned[1][n], turned[2][n]]);
            for m in 0..3 {
                out[m][n] = column[m];
            }
        }
        out
    }

    /// Transforms a vector from the principal basis to global axes.
    #[inline(always)]
    pub fn turn(&self, v: &[T; 3]) -> [T; 3] {
        let mut out = *v;
        for m in 0..3 {
            out[m] = dot(&[self.axes[0][m], self.axes[1][m], self.axes[2][m]], v);
        }
        out
    }
}
