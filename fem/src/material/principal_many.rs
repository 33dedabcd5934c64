//! Principal logarithmic strains at several points at once, without a branch on any of them.
//!
//! The formulas are those of [`super::kinematics`] but for the logarithm and for x coth x, which
//! follow from the eigenvalues w of b − I: with y = (w_i − w_j)/(2 + w_i + w_j) = tanh(ε_i − ε_j),
//! x coth x is artanh(y)/y, smooth through equal stretches.

use faer::traits::pulp::Simd;

use super::kinematics::Inverted;
use super::many::Many;

/// The deformation at several points, turned into the eigenvectors of b = F Fᵀ.
#[derive(Clone, Copy)]
pub(crate) struct PrincipalMany<S: Simd> {
    /// ε_i = ½ log(1 + w_i).
    pub(crate) strain: [Many<S>; 3],
    /// x coth x of x = ε_i − ε_j, at the third index.
    pub(crate) coth: [Many<S>; 3],
    /// The eigenvectors n_i: `basis[k][i]` is component k of number i.
    pub(crate) basis: [[Many<S>; 3]; 3],
    /// Qᵀ F⁻ᵀ: takes a reference gradient to the spatial one, in the basis n_i.
    pub(crate) push: [[Many<S>; 3]; 3],
}

impl<S: Simd> PrincipalMany<S> {
    /// Principal logarithmic strains of F = I + H.
    #[inline(always)]
    pub(crate) fn new(h: &[[Many<S>; 3]; 3]) -> Result<Self, Inverted> {
        let zero = h[0][0].constant(0.0);
        let one = zero.constant(1.0);
        let mut f = *h;
        for i in 0..3 {
            f[i][i] += one;
        }
        // cofactors: row i of F⁻ᵀ det F
        let mut cofactor = [[zero; 3]; 3];
        for i in 0..3 {
            let (a, b) = (f[(i + 1) % 3], f[(i + 2) % 3]);
            for j in 0..3 {
                let (k, l) = ((j + 1) % 3, (j + 2) % 3);
                cofactor[i][j] = a[k] * b[l] - a[l] * b[k];
            }
        }
        let determinant = dot(&f[0], &cofactor[0]);
        let sound = zero.less_than(determinant).all()
            && determinant.less_than(zero.constant(f64::INFINITY)).all();
        if !sound {
            return Err(Inverted);
        }
        let mut excess = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                excess[i][j] = dot(&h[i], &h[j]) + (h[i][j] + h[j][i]);
                excess[j][i] = excess[i][j];
            }
        }
        let (values, basis) = symmetric_eigen(excess);
        let inverse = one / determinant;
        let (mut strain, mut coth, mut push) = ([zero; 3], [zero; 3], [[zero; 3]; 3]);
        for i in 0..3 {
            strain[i] = zero.constant(0.5) * values[i].ln_1p();
            for j in 0..3 {
                let column = [basis[0][i], basis[1][i], basis[2][i]];
                push[i][j] =
                    inverse * dot(&column, &[cofactor[0][j], cofactor[1][j], cofactor[2][j]]);
            }
        }
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let tanh = (values[i] - values[j]) / (values[i] + values[j] + zero.constant(2.0));
            // further apart, the difference of the strains has its digits
            let near = tanh.abs().less_than(zero.constant(0.1));
            coth[k] = near.select(tanh.artanh_ratio(), (strain[i] - strain[j]) / tanh);
        }
        Ok(Self { strain, coth, basis, push })
    }

    /// P = τ F⁻ᵀ for the principal values of τ, times `weight`.
    #[inline(always)]
    pub(crate) fn piola(&self, stress: &[Many<S>; 3], weight: Many<S>) -> [[Many<S>; 3]; 3] {
        let mut scaled = self.push;
        for i in 0..3 {
            let stress = weight * stress[i];
            for j in 0..3 {
                scaled[i][j] = stress * self.push[i][j];
            }
        }
        let mut out = scaled;
        for i in 0..3 {
            for j in 0..3 {
                out[i][j] = dot(&self.basis[i], &[scaled[0][j], scaled[1][j], scaled[2][j]]);
            }
        }
        out
    }
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: &[Many<S>; 3], b: &[Many<S>; 3]) -> Many<S> {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// Eigenvalues and eigenvectors (columns) of symmetric 3 × 3 matrices by cyclic Jacobi rotations,
/// until the last of the points is done.
#[inline(always)]
pub(super) fn symmetric_eigen<S: Simd>(
    mut m: [[Many<S>; 3]; 3],
) -> ([Many<S>; 3], [[Many<S>; 3]; 3]) {
    const SWEEPS: usize = 12;
    let zero = m[0][0].constant(0.0);
    let mut q = [[zero; 3]; 3];
    for i in 0..3 {
        q[i][i] = zero.constant(1.0);
    }
    let off =
        |m: &[[Many<S>; 3]; 3]| dot(&[m[0][1], m[0][2], m[1][2]], &[m[0][1], m[0][2], m[1][2]]);
    let diagonal = dot(&[m[0][0], m[1][1], m[2][2]], &[m[0][0], m[1][1], m[2][2]]);
    let limit = (off(&m) + off(&m) + diagonal) * zero.constant(1e-33);
    for _ in 0..SWEEPS {
        if off(&m).at_most(limit).all() {
            break;
        }
        rotate::<S, 0, 1, 2>(&mut m, &mut q);
        rotate::<S, 0, 2, 1>(&mut m, &mut q);
        rotate::<S, 1, 2, 0>(&mut m, &mut q);
    }
    ([m[0][0], m[1][1], m[2][2]], q)
}

/// One Jacobi rotation that makes `m[P][Q]` zero; R is the third index.
///
/// tan θ = 2 m_pq sgn d / (|d| + √(d² + 4 m_pq²)) with d = m_qq − m_pp; where both vanish, none.
#[inline(always)]
fn rotate<S: Simd, const P: usize, const Q: usize, const R: usize>(
    m: &mut [[Many<S>; 3]; 3],
    q: &mut [[Many<S>; 3]; 3],
) {
    let one = m[0][0].constant(1.0);
    let zero = one.constant(0.0);
    let off = m[P][Q];
    let twice = off + off;
    let d = m[Q][Q] - m[P][P];
    let root = d.mul_add(d, twice * twice).sqrt();
    // the bounds hold where squares underflow
    let size = (d.abs() + root).max(one.constant(f64::MIN_POSITIVE));
    let signed = d.less_than(zero).select(-twice, twice);
    let t = (signed / size).min(one).max(-one);
    let c = one / t.mul_add(t, one).sqrt();
    let s = t * c;
    m[P][P] = m[P][P] - t * off;
    m[Q][Q] += t * off;
    m[P][Q] = zero;
    m[Q][P] = zero;
    let (rp, rq) = (m[R][P], m[R][Q]);
    m[R][P] = c * rp - s * rq;
    m[R][Q] = s.mul_add(rp, c * rq);
    m[P][R] = m[R][P];
    m[Q][R] = m[R][Q];
    for i in 0..3 {
        let (qp, qq) = (q[i][P], q[i][Q]);
        q[i][P] = c * qp - s * qq;
        q[i][Q] = s.mul_add(qp, c * qq);
    }
}
