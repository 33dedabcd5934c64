//! The point data, from which the tangent of an element is computed, and their order.
//!
//! With s_k = Qᵀ F⁻ᵀ ∇λ_k, the gradient of u in the principal axes Q of the strain is h = Σ_k (Qᵀ U_k) ⊗ s_k.
//! The tangent maps h to f_ii = Σ_j D_ij h_jj − τ_i h_ii and f_ij = G_ij (h_ij + h_ji) + τ_j h_ij. The
//! transpose of the map from nodal values to h maps f to nodal forces. The point data of an elastic point are
//! therefore Q as a quaternion (4), s (9), and, multiplied by the weight of the point, D − τ (6), G (3) and τ
//! (3): 25 numbers, instead of 45 for the element matrix. With damage, each point also has τ⁺ (3).
//!
//! The order of the point data is the order in which a product reads them. With damage, the points are
//! preceded by g′ of the damage points and by the gradient term 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l V (6). The points are
//! followed by the local part of the φ block at the damage points, stored once if it is the same at all of
//! them.
//!
//! Curved elements and mixtures need more point data: each point also has the second derivative of its energy
//! in g (1) and its own gradient term (6), both multiplied by the weight. The gradient term before the points
//! is then absent.

use crate::element::Rule;
use crate::material::{Number, PointTangent, Scalar};

/// Offsets within the point data of an elastic point: √2 (x, y, z, w) of Q, s_1 to s_3, D − τ packed, G, τ, τ⁺.
pub(super) const ROTATION: usize = 0;
pub(super) const PUSH: usize = 4;
pub(super) const NORMAL: usize = 13;
pub(super) const SHEAR: usize = 19;
pub(super) const STRESS: usize = 22;
pub(super) const SOURCE: usize = 25;
/// Offsets of the point data that only elements which are not plain have.
pub(super) const SOFTENING: usize = 28;
pub(super) const GRADIENT: usize = 29;
/// Number of entries of the gradient term.
pub(super) const SLOPES: usize = 6;

/// Offsets into the point data of an element.
#[derive(Clone, Copy, Debug)]
pub struct PointData {
    points: usize,
    damage: usize,
    alike: bool,
    plain: bool,
}

impl PointData {
    /// The offsets for a rule; `plain` is true for straight elements that are not mixtures.
    #[inline(always)]
    pub fn of(rule: &Rule, plain: bool) -> Self {
        let damage = rule.damage.len();
        Self { points: rule.points.len(), damage, alike: rule.alike, plain }
    }

    /// Number of entries per elastic point.
    #[inline(always)]
    pub const fn each(damage: usize, plain: bool) -> usize {
        match (damage, plain) {
            (0, _) => SOURCE,
            (_, true) => SOURCE + 3,
            (_, false) => GRADIENT + SLOPES,
        }
    }

    /// Number of entries before the elastic points.
    #[inline(always)]
    pub const fn head(damage: usize, plain: bool) -> usize {
        if damage > 0 && plain { damage + SLOPES } else { damage }
    }

    /// Offset of the gradient term of elastic point q.
    #[inline(always)]
    pub fn gradient(self, q: usize) -> usize {
        if self.plain { self.damage } else { self.point(q) + GRADIENT }
    }

    /// Offset of elastic point q.
    #[inline(always)]
    pub fn point(self, q: usize) -> usize {
        Self::head(self.damage, self.plain) + q * Self::each(self.damage, self.plain)
    }

    /// Number of entries of the local part of the φ block.
    pub fn locals(self) -> usize {
        if self.alike { self.damage.min(1) } else { self.damage }
    }

    /// Offset of the local part of damage point p.
    #[inline(always)]
    pub fn local(self, p: usize) -> usize {
        self.point(self.points) + if self.alike { 0 } else { p }
    }

    /// Number of entries of an element.
    pub fn width(self) -> usize {
        self.point(self.points) + self.locals()
    }

    /// Number of entries of an element if the principal axes are appended.
    pub fn width_with_axes(self) -> usize {
        self.width() + 9 * self.points
    }

    /// Writes the principal axes of elastic point q behind the other point data.
    #[inline(always)]
    pub fn write_axes<T: Scalar>(self, q: usize, axes: &[[T; 3]; 3], out: &mut [T]) {
        let place = self.width() + 9 * q;
        for i in 0..3 {
            for m in 0..3 {
                out[place + 3 * i + m] = axes[i][m];
            }
        }
    }

    /// Reads the tangent of elastic point q, and the vectors s_k.
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

/// Writes the point data of an elastic point except τ⁺; `push` has the vectors s_k. With `AXES` the quaternion is not
/// written.
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

/// The principal axes, one per row, from √2 (x, y, z, w).
#[inline(always)]
pub(super) fn principal_axes<T: Number>([x, y, z, w]: [T; 4]) -> [[T; 3]; 3] {
    let one = x.constant(1.0);
    [
        [one - y * y - z * z, x * y + w * z, x * z - w * y],
        [x * y - w * z, one - x * x - z * z, y * z + w * x],
        [x * z + w * y, y * z - w * x, one - x * x - y * y],
    ]
}

/// √2 (x, y, z, w) of the rotation from the coordinate axes to the given axes.
///
/// The entries of the matrix 4 q qᵀ are sums of entries of the rotation matrix. Each of its rows is a
/// multiple of q. The row with the largest diagonal entry is used, because it loses no digits to
/// cancellation.
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
