//! Principal logarithmic strains of a displacement gradient.
//!
//! The eigenpairs are computed from b − I = H + Hᵀ + H Hᵀ instead of b, so that small strains keep their digits. The
//! function x coth x with x = ε_i − ε_j is also computed from the eigenvalues w of b − I: with y = (w_i − w_j)/(2 +
//! w_i + w_j) = tanh(ε_i − ε_j), the function is artanh(y)/y, which is smooth at equal stretches.

use super::number::{Scalar, dot};
use crate::error::StepFailure;

/// Deformation at a point, in the basis of the eigenvectors of b = F Fᵀ.
#[derive(Clone, Copy, Debug)]
pub struct Principal<T> {
    pub strains: Strains<T>,
    /// Eigenvectors n_i: `basis[k][i]` is component k of vector i.
    pub basis: [[T; 3]; 3],
    /// Matrix Qᵀ F⁻ᵀ, where the columns of Q are the eigenvectors n_i. The matrix transforms a reference gradient to
    /// the spatial gradient in the basis n_i.
    pub push: [[T; 3]; 3],
    /// 1 if det F is positive and finite, else 0. If 0, the strains are set to zero.
    pub sound: T,
}

/// Principal strains in the forms that laws need.
#[derive(Clone, Copy, Debug)]
pub struct Strains<T> {
    /// Logarithmic strains ε_i = ½ log(1 + w_i).
    pub log: [T; 3],
    /// w_i = λ_i² − 1, the eigenvalues of b − I.
    pub excess: [T; 3],
    /// x coth x with x = ε_i − ε_j; entry k belongs to the pair (i, j) of the other two strains.
    pub coth: [T; 3],
}

/// Error for a deformation gradient whose determinant is not positive and finite.
#[derive(Clone, Copy, Debug)]
pub struct Inverted;

impl From<Inverted> for StepFailure {
    fn from(_: Inverted) -> Self {
        StepFailure::Inverted
    }
}

impl<T: Scalar> Strains<T> {
    /// Computes the strains from the eigenvalues of b − I.
    #[inline(always)]
    fn from_excess(excess: [T; 3]) -> Self {
        let half = excess[0].constant(0.5);
        let mut log = excess;
        for i in 0..3 {
            log[i] = half * excess[i].ln_1p();
        }
        Self::new(log, excess)
    }

    #[inline(always)]
    pub(crate) fn new(log: [T; 3], excess: [T; 3]) -> Self {
        let mut coth = log;
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let two = log[k].constant(2.0);
            let tanh = (excess[i] - excess[j]) / (excess[i] + excess[j] + two);
            // near eigenvalues need the series, because the difference of their strains cancels
            let near = tanh.abs().less_than(two.constant(0.1));
            coth[k] = T::select(near, tanh.artanh_ratio(), (log[i] - log[j]) / tanh);
        }
        Self { log, excess, coth }
    }

    /// Returns tr ε = ln J.
    #[inline(always)]
    pub fn trace(&self) -> T {
        self.log[0] + self.log[1] + self.log[2]
    }
}

impl<T: Scalar> Principal<T> {
    /// Computes the principal logarithmic strains of F = I + H.
    #[inline(always)]
    pub fn new(h: &[[T; 3]; 3]) -> Self {
        Self::of_elastic_part(h, None)
    }

    /// Computes the principal logarithmic strains of the elastic part b_e = F C_p⁻¹ Fᵀ of the deformation F = I + H, for
    /// C_p⁻¹ − I packed as by [`packed`](super::packed). `None`: C_p = I. `push` contains the whole F.
    #[inline(always)]
    pub fn of_elastic_part(h: &[[T; 3]; 3], plastic: Option<&[T; 6]>) -> Self {
        let zero = h[0][0].constant(0.0);
        let one = zero.constant(1.0);
        let mut f = *h;
        for i in 0..3 {
            f[i][i] += one;
        }
        // cofactors: row i of det F · F⁻ᵀ
        let mut cofactor = [[zero; 3]; 3];
        for i in 0..3 {
            let (a, b) = (f[(i + 1) % 3], f[(i + 2) % 3]);
            for j in 0..3 {
                let (k, l) = ((j + 1) % 3, (j + 2) % 3);
                cofactor[i][j] = a[k] * b[l] - a[l] * b[k];
            }
        }
        let determinant = dot(&f[0], &cofactor[0]);
        let finite = determinant.less_than(zero.constant(f64::INFINITY));
        let sound = T::select(zero.less_than(determinant), T::select(finite, one, zero), zero);
        let mut excess = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                excess[i][j] = dot(&h[i], &h[j]) + (h[i][j] + h[j][i]);
                excess[j][i] = excess[i][j];
            }
        }
        if let Some(plastic) = plastic {
            let [xx, yx, yy, zx, zy, zz] = *plastic;
            let rows = [[xx, yx, zx], [yx, yy, zy], [zx, zy, zz]];
            for i in 0..3 {
                let image = [dot(&rows[0], &f[i]), dot(&rows[1], &f[i]), dot(&rows[2], &f[i])];
                for j in 0..=i {
                    excess[i][j] += dot(&image, &f[j]);
                    excess[j][i] = excess[i][j];
                }
            }
        }
        let (mut values, basis) = symmetric_eigen(excess);
        let inverse = one / determinant;
        let mut push = [[zero; 3]; 3];
        for i in 0..3 {
            values[i] = T::select(zero.less_than(sound), values[i], zero);
            for j in 0..3 {
                let column = [basis[0][i], basis[1][i], basis[2][i]];
                push[i][j] =
                    inverse * dot(&column, &[cofactor[0][j], cofactor[1][j], cofactor[2][j]]);
            }
        }
        Self { strains: Strains::from_excess(values), basis, push, sound }
    }

    /// Returns the nominal stress P = τ F⁻ᵀ times `weight`. `stress` contains the diagonal components of τ in the
    /// principal axes of the strain, and `oblique` the other components (entry k belongs to the pair of the other two
    /// axes); `None`: the other components are zero.
    #[inline(always)]
    pub fn piola(&self, stress: &[T; 3], oblique: Option<&[T; 3]>, weight: T) -> [[T; 3]; 3] {
        let mut scaled = self.push;
        for i in 0..3 {
            let stress = weight * stress[i];
            for j in 0..3 {
                scaled[i][j] = stress * self.push[i][j];
            }
        }
        if let Some(oblique) = oblique {
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let component = weight * oblique[k];
                for x in 0..3 {
                    scaled[i][x] = component.mul_add(self.push[j][x], scaled[i][x]);
                    scaled[j][x] = component.mul_add(self.push[i][x], scaled[j][x]);
                }
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

/// Returns eigenvalues and eigenvectors (columns) of symmetric 3 × 3 matrices by cyclic Jacobi rotations, which are
/// accurate to rounding errors also for equal and nearly equal eigenvalues. With several lanes, the sweeps continue
/// until all lanes have converged.
#[inline(always)]
fn symmetric_eigen<T: Scalar>(mut m: [[T; 3]; 3]) -> ([T; 3], [[T; 3]; 3]) {
    const SWEEPS: usize = 12;
    let zero = m[0][0].constant(0.0);
    let mut q = [[zero; 3]; 3];
    for i in 0..3 {
        q[i][i] = zero.constant(1.0);
    }
    let diagonal = dot(&[m[0][0], m[1][1], m[2][2]], &[m[0][0], m[1][1], m[2][2]]);
    // the smallest positive number makes the zero matrix count as converged
    let limit = (off_diagonal(&m) + off_diagonal(&m) + diagonal)
        .mul_add(zero.constant(1e-33), zero.constant(f64::MIN_POSITIVE));
    if T::RECORDS {
        let mut state = Jacobi { m, q, limit }.values();
        T::record_loop("jacobi", SWEEPS, &mut state, |state| {
            let mut at = Jacobi::from_values(state);
            let settled = off_diagonal(&at.m).less_than(at.limit);
            sweep(&mut at.m, &mut at.q);
            state.copy_from_slice(&at.values());
            settled
        });
        Jacobi { m, q, .. } = Jacobi::from_values(&state);
        return ([m[0][0], m[1][1], m[2][2]], q);
    }
    for _ in 0..SWEEPS {
        if T::settled(off_diagonal(&m).less_than(limit)) {
            break;
        }
        sweep(&mut m, &mut q);
    }
    ([m[0][0], m[1][1], m[2][2]], q)
}

/// Performs one Jacobi sweep: three rotations, in place.
#[inline(always)]
fn sweep<T: Scalar>(m: &mut [[T; 3]; 3], q: &mut [[T; 3]; 3]) {
    rotate::<T, 0, 1, 2>(m, q);
    rotate::<T, 0, 2, 1>(m, q);
    rotate::<T, 1, 2, 0>(m, q);
}

/// Variables of the Jacobi sweeps, as the state of a recorded loop.
struct Jacobi<T> {
    m: [[T; 3]; 3],
    q: [[T; 3]; 3],
    limit: T,
}

impl<T: Scalar> Jacobi<T> {
    /// Row and column of the entries of `m` in [`values`](Self::values): the lower triangle of `m`, then `q`, then
    /// `limit`.
    const PLACES: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

    fn values(&self) -> [T; 16] {
        let mut values = [self.limit; 16];
        for (number, (i, j)) in values.iter_mut().zip(Self::PLACES) {
            *number = self.m[i][j];
        }
        values[6..15].copy_from_slice(self.q.as_flattened());
        values
    }

    fn from_values(values: &[T]) -> Self {
        let limit = values[15];
        let (mut m, mut q) = ([[limit; 3]; 3], [[limit; 3]; 3]);
        for (number, (i, j)) in values.iter().zip(Self::PLACES) {
            (m[i][j], m[j][i]) = (*number, *number);
        }
        q.as_flattened_mut().copy_from_slice(&values[6..15]);
        Self { m, q, limit }
    }
}

/// Returns the sum of the squares of the entries above the diagonal.
#[inline(always)]
fn off_diagonal<T: Scalar>(m: &[[T; 3]; 3]) -> T {
    dot(&[m[0][1], m[0][2], m[1][2]], &[m[0][1], m[0][2], m[1][2]])
}

/// Applies one Jacobi rotation, which makes `m[P][Q]` zero; R is the third index.
///
/// tan θ = 2 m_pq sgn d / (|d| + √(d² + 4 m_pq²)) with d = m_qq − m_pp; no rotation if d and m_pq are zero.
#[inline(always)]
fn rotate<T: Scalar, const P: usize, const Q: usize, const R: usize>(
    m: &mut [[T; 3]; 3],
    q: &mut [[T; 3]; 3],
) {
    let one = m[0][0].constant(1.0);
    let zero = one.constant(0.0);
    let off = m[P][Q];
    let twice = off + off;
    let d = m[Q][Q] - m[P][P];
    let root = d.mul_add(d, twice * twice).sqrt();
    // |t| ≤ 1 except if the squares underflow
    let size = (d.abs() + root).max(one.constant(f64::MIN_POSITIVE));
    let signed = T::select(d.less_than(zero), -twice, twice);
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
