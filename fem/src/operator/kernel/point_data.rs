//! Stored data of an element's tangent, and their order in memory.
//!
//! With s_k = Qᵀ F⁻ᵀ ∇λ_k, the gradient of u in the principal axes Q of the strain is h = Σ_k (Qᵀ U_k) ⊗ s_k, and the
//! tangent maps h to a stress increment (`contract.rs`). Instead of the element matrix, the data of each elastic
//! point are stored: 25 numbers, 3 more with damage, 7 more with damage in elements that are not plain, and 15 more
//! in elements with tangent terms of viscoelastic and plastic laws.
//!
//! The data are stored in the order in which a product reads them. With damage, first g′ of the damage points and, in
//! plain elements, one gradient term; then the data of the elastic points; then the local part of the φ block: the
//! damage terms without gradients; last the tangent terms of inelastic laws. Elements that are not plain store a
//! gradient term per elastic point instead. The assembly appends the principal axes of each point.

use crate::element::Rule;
use crate::material::{Number, Scalar};

/// Number of entries of an elastic point without damage: rotation (4), s_1 to s_3 (9), D − τ (6), G (3), τ (3).
const ELASTIC: usize = 4 + 9 + 6 + 3 + 3;
/// Number of entries of τ⁺.
const SOURCE: usize = 3;
/// Number of entries of a gradient term.
const GRADIENT: usize = 6;
/// Number of entries of the tangent terms of viscoelastic and plastic laws.
const EXTRA: usize = 15;
/// Number of entries of principal axes.
const AXES: usize = 9;

/// Splits the first entries off a slice; `None` if the slice is empty.
macro_rules! split_optional {
    ($data:expr, $split:ident) => {
        match $data.len() {
            0 => (None, $data),
            _ => {
                let (first, rest) = $data.$split().expect("a length of the layout");
                (Some(first), rest)
            }
        }
    };
}

/// Defines a view of the stored data of an elastic point; the second view can be written to.
macro_rules! stored_point {
    ($(#[$doc:meta])* $name:ident, $split:ident $(, $mutable:tt)?) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name<'a, P> {
            /// Rotation Q as √2 times its unit quaternion (x, y, z, w).
            pub rotation: &'a $($mutable)? [P; 4],
            /// Vectors s_1, s_2, s_3 with s_k = Qᵀ F⁻ᵀ ∇λ_k.
            pub push: &'a $($mutable)? [P; 9],
            /// D_ij − δ_ij τ_i, packed, times the weight of the point.
            pub normal: &'a $($mutable)? [P; 6],
            /// G_ij times the weight of the point; entry k belongs to the pair (i, j) of the other two axes.
            pub shear: &'a $($mutable)? [P; 3],
            /// τ_i times the weight of the point.
            pub stress: &'a $($mutable)? [P; 3],
            /// τ⁺_i times the weight of the point; `None` without damage.
            pub source: Option<&'a $($mutable)? [P; SOURCE]>,
            /// Second derivative of the energy with respect to g, times the weight of the point; `None` in plain
            /// elements.
            pub driving_slope: Option<&'a $($mutable)? [P; 1]>,
            /// Gradient term 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l, packed, times the weight of the point; `None` in plain elements,
            /// which store the term once per element.
            pub gradient: Option<&'a $($mutable)? [P; GRADIENT]>,
        }

        impl<'a, P> $name<'a, P> {
            /// Splits the data of one elastic point into the fields of this view.
            #[inline(always)]
            fn new(data: &'a $($mutable)? [P]) -> Self {
                const FITS: &str = "a length of the layout";
                let (rotation, data) = data.$split().expect(FITS);
                let (push, data) = data.$split().expect(FITS);
                let (normal, data) = data.$split().expect(FITS);
                let (shear, data) = data.$split().expect(FITS);
                let (stress, data) = data.$split().expect(FITS);
                let (source, data) = split_optional!(data, $split);
                let (driving_slope, data) = split_optional!(data, $split);
                let (gradient, _) = split_optional!(data, $split);
                Self { rotation, push, normal, shear, stress, source, driving_slope, gradient }
            }
        }
    };
}

stored_point!(
    /// Stored tangent data of an elastic point.
    StoredPoint,
    split_first_chunk
);
stored_point!(
    /// Stored tangent data of an elastic point, for writing.
    StoredPointMut,
    split_first_chunk_mut,
    mut
);

/// Order of the stored data of an element's tangent.
#[derive(Clone, Copy, Debug)]
pub struct DataLayout {
    /// Number of elastic points.
    elastic_points: usize,
    /// Number of damage points.
    damage: usize,
    /// Number of entries of the local part of the φ block (damage terms without gradients): one if the local part is
    /// the same at all damage points.
    locals: usize,
    plain: bool,
    /// Whether the tangent terms of viscoelastic and plastic laws are stored.
    extra: bool,
}

/// Tangent terms of viscoelastic and plastic laws at an elastic point, times the weight of the point. Entry k of
/// the components outside the principal axes belongs to the pair of the other two axes.
#[derive(Clone, Copy, Debug)]
pub struct ExtraPoint<'a, P> {
    /// Components of τ outside the principal axes.
    pub oblique: &'a [P; 3],
    /// Components of ∂τ/∂g outside the principal axes.
    pub oblique_source: &'a [P; 3],
    /// Derivative of the driving energy with respect to the principal strains.
    pub driving: &'a [P; 3],
    /// Derivative of the driving energy with respect to the strains outside the principal axes.
    pub oblique_driving: &'a [P; 3],
    /// Antisymmetric part w of D: D_ij − D_ji = 2 (w_i − w_j).
    pub skew: &'a [P; 3],
}

impl DataLayout {
    /// Creates the layout for a quadrature rule; `plain` is true for straight elements that are not mixtures
    /// and have no tangent terms of viscoelastic or plastic laws.
    #[inline(always)]
    pub fn new(rule: &Rule, plain: bool) -> Self {
        let damage = rule.damage.len();
        let locals = if rule.alike { damage.min(1) } else { damage };
        let layout = Self::for_kind(rule.elastic_points.len(), damage, locals, plain);
        // the tangent terms of inelastic laws need the second derivative in g, which plain elements
        // do not store
        Self { extra: rule.extra.stored && !plain, ..layout }
    }

    /// Returns this layout with or without the tangent terms of viscoelastic and plastic laws;
    /// `stored` states whether the terms are stored.
    #[inline(always)]
    pub const fn with_extra(self, stored: bool) -> Self {
        Self { extra: stored, ..self }
    }

    /// Creates the layout from the numbers of elastic points, damage points and entries of the local part.
    #[inline(always)]
    pub const fn for_kind(
        elastic_points: usize,
        damage: usize,
        locals: usize,
        plain: bool,
    ) -> Self {
        Self { elastic_points, damage, locals, plain, extra: false }
    }

    /// Returns the number of entries per elastic point.
    #[inline(always)]
    pub const fn per_point(self) -> usize {
        match (self.damage, self.plain) {
            (0, _) => ELASTIC,
            (_, true) => ELASTIC + SOURCE,
            (_, false) => ELASTIC + SOURCE + 1 + GRADIENT,
        }
    }

    /// Returns the offset of elastic point q. For q = number of elastic points, it is the offset of the local part.
    #[inline(always)]
    pub const fn point_offset(self, q: usize) -> usize {
        let shared = if self.damage > 0 && self.plain { GRADIENT } else { 0 };
        self.damage + shared + q * self.per_point()
    }

    /// Returns the number of entries of an element.
    #[inline(always)]
    pub fn width(self) -> usize {
        let extra = if self.extra { EXTRA * self.elastic_points } else { 0 };
        self.extra_offset(0) + extra
    }

    /// Returns the offset of the tangent terms of inelastic laws at elastic point q, which follow
    /// the local part.
    #[inline(always)]
    const fn extra_offset(self, q: usize) -> usize {
        self.point_offset(self.elastic_points) + self.locals + EXTRA * q
    }

    /// Returns the tangent terms of inelastic laws at elastic point q; `None` if they are not
    /// stored.
    #[inline(always)]
    pub fn extra<P>(self, q: usize, data: &[P]) -> Option<ExtraPoint<'_, P>> {
        const FITS: &str = "a length of the layout";
        if !self.extra {
            return None;
        }
        let data = &data[self.extra_offset(q)..];
        let (oblique, data) = data.split_first_chunk().expect(FITS);
        let (oblique_source, data) = data.split_first_chunk().expect(FITS);
        let (driving, data) = data.split_first_chunk().expect(FITS);
        let (oblique_driving, data) = data.split_first_chunk().expect(FITS);
        let (skew, _) = data.split_first_chunk().expect(FITS);
        Some(ExtraPoint { oblique, oblique_source, driving, oblique_driving, skew })
    }

    /// Returns the tangent terms of inelastic laws at elastic point q, for writing, in the order of the
    /// fields of [`ExtraPoint`].
    #[inline(always)]
    pub fn extra_mut<P>(self, q: usize, data: &mut [P]) -> Option<&mut [P; EXTRA]> {
        self.extra.then(|| {
            data[self.extra_offset(q)..].first_chunk_mut().expect("a length of the layout")
        })
    }

    /// Returns the number of entries of an element if the principal axes are appended.
    pub fn width_with_axes(self) -> usize {
        self.width() + AXES * self.elastic_points
    }

    /// Returns g′ of the damage points.
    #[inline(always)]
    pub fn degradation_slopes<P>(self, data: &[P]) -> &[P] {
        &data[..self.damage]
    }

    #[inline(always)]
    pub fn degradation_slopes_mut<P>(self, data: &mut [P]) -> &mut [P] {
        &mut data[..self.damage]
    }

    /// Returns the stored tangent data of elastic point q.
    #[inline(always)]
    pub fn point<P>(self, q: usize, data: &[P]) -> StoredPoint<'_, P> {
        StoredPoint::new(&data[self.point_offset(q)..][..self.per_point()])
    }

    #[inline(always)]
    pub fn point_mut<P>(self, q: usize, data: &mut [P]) -> StoredPointMut<'_, P> {
        StoredPointMut::new(&mut data[self.point_offset(q)..][..self.per_point()])
    }

    /// Returns the gradient term of a plain element, 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l times the volume of the element, packed.
    #[inline(always)]
    pub fn shared_gradient<P>(self, data: &[P]) -> &[P; GRADIENT] {
        data[self.damage..].first_chunk().expect("plain elements store it")
    }

    #[inline(always)]
    pub fn shared_gradient_mut<P>(self, data: &mut [P]) -> &mut [P; GRADIENT] {
        data[self.damage..].first_chunk_mut().expect("plain elements store it")
    }

    /// Returns the local part of the φ block (the terms without gradients) at damage point p.
    #[inline(always)]
    pub fn local<P>(self, p: usize, data: &[P]) -> &P {
        &data[self.point_offset(self.elastic_points)..][..self.locals][p % self.locals]
    }

    #[inline(always)]
    pub fn local_mut<P>(self, p: usize, data: &mut [P]) -> &mut P {
        &mut data[self.point_offset(self.elastic_points)..][..self.locals][p % self.locals]
    }

    /// Returns the appended principal axes of elastic point q, one per row.
    #[inline(always)]
    pub fn axes<P: Copy>(self, q: usize, data: &[P]) -> [[P; 3]; 3] {
        let axes: &[P; AXES] =
            data[self.width() + AXES * q..].first_chunk().expect("the axes are appended");
        let [a, b, c, d, e, f, g, h, i] = *axes;
        [[a, b, c], [d, e, f], [g, h, i]]
    }

    #[inline(always)]
    pub fn axes_mut<P>(self, q: usize, data: &mut [P]) -> &mut [P; AXES] {
        data[self.width() + AXES * q..].first_chunk_mut().expect("the axes are appended")
    }
}

/// Returns the principal axes, one per row, from √2 times the unit quaternion (x, y, z, w).
#[inline(always)]
pub(super) fn principal_axes<T: Number>([x, y, z, w]: [T; 4]) -> [[T; 3]; 3] {
    let one = x.constant(1.0);
    [
        [one - y * y - z * z, x * y + w * z, x * z - w * y],
        [x * y - w * z, one - x * x - z * z, y * z + w * x],
        [x * z + w * y, y * z - w * x, one - x * x - y * y],
    ]
}

/// Returns √2 times the unit quaternion (x, y, z, w) of the rotation from the coordinate axes to the given axes.
///
/// With the unit quaternion q, the entries of the matrix 4 q qᵀ are sums of entries of the rotation matrix, and each
/// row of 4 q qᵀ is a multiple of q. The row with the largest diagonal entry is used, because this row loses no
/// digits to cancellation.
#[inline(always)]
pub(super) fn rotation<T: Scalar>(m: &[[T; 3]; 3]) -> [T; 4] {
    let one = m[0][0].constant(1.0);
    let turn = [m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0]];
    let pair = [m[2][1] + m[1][2], m[2][0] + m[0][2], m[1][0] + m[0][1]];
    let mut largest = one + m[0][0] + m[1][1] + m[2][2];
    let mut best = [turn[0], turn[1], turn[2], largest];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let diagonal = one + m[k][k] - m[i][i] - m[j][j];
        let mut row = [diagonal; 4];
        row[i] = pair[j];
        row[j] = pair[i];
        row[3] = turn[k];
        let larger = largest.less_than(diagonal);
        largest = T::select(larger, diagonal, largest);
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
