//! The numbers that the tangent of an element consists of, and their order.
//!
//! With s_k = Qᵀ F⁻ᵀ ∇λ_k, the gradient of u in the principal axes Q of the strain is
//! h = Σ_k (Qᵀ U_k) ⊗ s_k. The tangent takes it to f_ii = Σ_j D_ij h_jj − τ_i h_ii and
//! f_ij = G_ij (h_ij + h_ji) + τ_j h_ij, and the transpose of the way to h brings f back to the nodes.
//! So there are for each elastic point Q as a quaternion (4), s (9), and times the weight of the
//! point D − τ (6), G (3) and τ (3), 25 numbers against the 45 of the product itself. Where there is
//! damage, the points have also τ⁺ (3); before them come g′ of the damage points and
//! 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l V (6), behind them the local part of the φ block at the damage points, once
//! if it is the same at all of them: the order in which a product reads them.
//!
//! Elements that are curved or mixtures take more: each point has also the second derivative of its
//! energy in g (1) and, in place of the one for all before the points, its own gradient term (6), both
//! times the weight.

use crate::element::Rule;
use crate::material::{Number, PointTangent, Scalar};

/// Where the numbers of a point begin: √2 (x, y, z, w) of Q, s by k, D − τ packed, G, τ, τ⁺.
pub(super) const ROTATION: usize = 0;
pub(super) const PUSH: usize = 4;
pub(super) const NORMAL: usize = 13;
pub(super) const SHEAR: usize = 19;
pub(super) const STRESS: usize = 22;
pub(super) const SOURCE: usize = 25;
/// Where those follow that only elements have which are not plain.
pub(super) const SOFTENING: usize = 28;
pub(super) const GRADIENT: usize = 29;
/// Entries of the gradient term.
pub(super) const SLOPES: usize = 6;

/// How many numbers there are of each kind.
#[derive(Clone, Copy, Debug)]
pub struct PointData {
    points: usize,
    damage: usize,
    alike: bool,
    plain: bool,
}

impl PointData {
    /// The numbers of a rule's tangents; `plain` for elements that are straight and no mixtures.
    #[inline(always)]
    pub fn of(rule: &Rule, plain: bool) -> Self {
        let damage = rule.damage.len();
        Self { points: rule.points.len(), damage, alike: rule.alike, plain }
    }

    /// Numbers of an elastic point.
    #[inline(always)]
    pub const fn each(damage: usize, plain: bool) -> usize {
        match (damage, plain) {
            (0, _) => SOURCE,
            (_, true) => SOURCE + 3,
            (_, false) => GRADIENT + SLOPES,
        }
    }

    /// Numbers before those of the points.
    #[inline(always)]
    pub const fn head(damage: usize, plain: bool) -> usize {
        if damage > 0 && plain { damage + SLOPES } else { damage }
    }

    /// Where the gradient term of elastic point q begins.
    #[inline(always)]
    pub fn gradient(self, q: usize) -> usize {
        if self.plain { self.damage } else { self.point(q) + GRADIENT }
    }

    /// Where elastic point q begins.
    #[inline(always)]
    pub fn point(self, q: usize) -> usize {
        Self::head(self.damage, self.plain) + q * Self::each(self.damage, self.plain)
    }

    /// Numbers of the local part.
    pub fn locals(self) -> usize {
        if self.alike { self.damage.min(1) } else { self.damage }
    }

    /// The place of the local part of damage point p.
    #[inline(always)]
    pub fn local(self, p: usize) -> usize {
        self.point(self.points) + if self.alike { 0 } else { p }
    }

    /// Numbers that an element's tangent takes.
    pub fn width(self) -> usize {
        self.point(self.points) + self.locals()
    }

    /// The same where the principal axes follow behind.
    pub fn width_with_axes(self) -> usize {
        self.width() + 9 * self.points
    }

    /// Writes the principal axes of elastic point q behind the other numbers.
    #[inline(always)]
    pub fn write_axes<T: Scalar>(self, q: usize, axes: &[[T; 3]; 3], out: &mut [T]) {
        let place = self.width() + 9 * q;
        for i in 0..3 {
            for m in 0..3 {
                out[place + 3 * i + m] = axes[i][m];
            }
        }
    }

    /// The tangent of elastic point q, and s by k.
    #[inline(always)]
    pub fn read_point<T: Scalar, const AXES: bool>(
        self,
        q: usize,
        numbers: &[T],
    ) -> (PointTangent<T>, [[T; 3]; 3]) {
        let point = &numbers[self.point(q)..];
        let zero = point[0].constant(0.0);
        let (mut normal, mut shear, mut stress) = ([zero; 6], [zero; 3], [zero; 3]);
        let (mut push, mut axes) = ([[zero; 3]; 3], [[zero; 3]; 3]);
        normal.copy_from_slice(&point[NORMAL..NORMAL + 6]);
        for k in 0..3 {
            for i in 0..3 {
                push[k][i] = point[PUSH + 3 * k + i];
                if AXES {
                    axes[k][i] = numbers[self.width() + 9 * q + 3 * k + i];
                }
            }
            shear[k] = point[SHEAR + k];
            stress[k] = point[STRESS + k];
        }
        if !AXES {
            axes = principal_axes([point[0], point[1], point[2], point[3]]);
        }
        (PointTangent { axes, normal, shear, stress }, push)
    }
}

/// Writes the numbers of an elastic point but for τ⁺; `push` is s by k. With `AXES` the quaternion
/// is left out.
#[inline(always)]
pub(super) fn write_point<T: Scalar, const AXES: bool>(
    tangent: &PointTangent<T>,
    push: &[[T; 3]; 3],
    out: &mut [T],
) {
    if !AXES {
        let rotation = rotation(&tangent.axes);
        out[ROTATION..ROTATION + 4].copy_from_slice(&rotation);
    }
    out[NORMAL..NORMAL + 6].copy_from_slice(&tangent.normal);
    for k in 0..3 {
        for i in 0..3 {
            out[PUSH + 3 * k + i] = push[k][i];
        }
        out[SHEAR + k] = tangent.shear[k];
        out[STRESS + k] = tangent.stress[k];
    }
}

/// The principal axes, one after the other, of √2 (x, y, z, w).
#[inline(always)]
pub(super) fn principal_axes<T: Number>([x, y, z, w]: [T; 4]) -> [[T; 3]; 3] {
    let one = x.constant(1.0);
    [
        [one - y * y - z * z, x * y + w * z, x * z - w * y],
        [x * y - w * z, one - x * x - z * z, y * z + w * x],
        [x * z + w * y, y * z - w * x, one - x * x - y * y],
    ]
}

/// √2 (x, y, z, w) of the rotation that takes the coordinates to these axes.
///
/// Each row of 4 q qᵀ, whose entries are sums of those of the matrix, is q times a number; that with
/// the largest diagonal entry loses no digits.
#[inline(always)]
fn rotation<T: Scalar>(m: &[[T; 3]; 3]) -> [T; 4] {
    let one = m[0][0].constant(1.0);
    let turn = [m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0]];
    let pair = [m[2][1] + m[1][2], m[2][0] + m[0][2], m[1][0] + m[0][1]];
    let mut largest = one + m[0][0] + m[1][1] + m[2][2];
    let mut best = [turn[0], turn[1], turn[2], largest];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let own = one + m[k][k] - m[i][i] - m[j][j];
        let mut row = [own; 4];
        row[i] = pair[j];
        row[j] = pair[i];
        row[3] = turn[k];
        let larger = largest.less_than(own);
        largest = T::select(larger, own, largest);
        for c in 0..4 {
            best[c] = T::select(larger, row[c], best[c]);
        }
    }
    let scale = one / (largest + largest).sqrt();
    for c in 0..4 {
        best[c] = best[c] * scale;
    }
    best
}
