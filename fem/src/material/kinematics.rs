//! Principal logarithmic strains of a displacement gradient.

use nalgebra::Matrix3;

/// The deformation at a point, turned into the eigenvectors of b = F Fᵀ.
#[derive(Clone, Debug)]
pub(crate) struct Principal {
    /// ε_i = ½ log(1 + w_i), with w_i the eigenvalues of b − I.
    pub(crate) strain: [f64; 3],
    /// The eigenvectors n_i, as columns.
    pub(crate) basis: Matrix3<f64>,
    /// Qᵀ F⁻ᵀ: takes a reference gradient to the spatial one, in the basis n_i.
    pub(crate) push: Matrix3<f64>,
}

/// det F ≤ 0, or not a number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inverted;

impl Principal {
    /// Principal logarithmic strains of F = I + `gradient`.
    ///
    /// The eigenpairs are those of b − I = H + Hᵀ + H Hᵀ, not of b, so that small strains keep
    /// their digits.
    pub(crate) fn new(gradient: &Matrix3<f64>) -> Result<Self, Inverted> {
        let f = Matrix3::identity() + gradient;
        let determinant = f.determinant();
        if determinant <= 0.0 || !determinant.is_finite() {
            return Err(Inverted);
        }
        let inverse = f.try_inverse().ok_or(Inverted)?;
        let excess = gradient + gradient.transpose() + gradient * gradient.transpose();
        let (values, basis) = symmetric_eigen(excess);
        Ok(Self {
            strain: values.map(|w| 0.5 * w.ln_1p()),
            basis,
            push: (inverse * basis).transpose(),
        })
    }
}

/// Eigenvalues and eigenvectors (columns) of a symmetric 3 × 3 matrix by cyclic Jacobi rotations,
/// which are accurate to round-off for equal and for nearly equal eigenvalues alike.
fn symmetric_eigen(mut m: Matrix3<f64>) -> ([f64; 3], Matrix3<f64>) {
    const SWEEPS: usize = 12;
    let mut q = Matrix3::identity();
    let scale = m.norm_squared();
    for _ in 0..SWEEPS {
        let off = m[(0, 1)].powi(2) + m[(0, 2)].powi(2) + m[(1, 2)].powi(2);
        if off <= 1e-34 * scale {
            break;
        }
        rotate::<0, 1, 2>(&mut m, &mut q);
        rotate::<0, 2, 1>(&mut m, &mut q);
        rotate::<1, 2, 0>(&mut m, &mut q);
    }
    ([m[(0, 0)], m[(1, 1)], m[(2, 2)]], q)
}

/// One Jacobi rotation that makes `m[P][Q]` zero; R is the third index.
#[inline(always)]
fn rotate<const P: usize, const Q: usize, const R: usize>(
    m: &mut Matrix3<f64>,
    q: &mut Matrix3<f64>,
) {
    let off = m[(P, Q)];
    if off == 0.0 {
        return;
    }
    let theta = (m[(Q, Q)] - m[(P, P)]) / (2.0 * off);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    m[(P, P)] -= t * off;
    m[(Q, Q)] += t * off;
    m[(P, Q)] = 0.0;
    m[(Q, P)] = 0.0;
    let (rp, rq) = (m[(R, P)], m[(R, Q)]);
    m[(R, P)] = c * rp - s * rq;
    m[(R, Q)] = s * rp + c * rq;
    m[(P, R)] = m[(R, P)];
    m[(Q, R)] = m[(R, Q)];
    for i in 0..3 {
        let (qp, qq) = (q[(i, P)], q[(i, Q)]);
        q[(i, P)] = c * qp - s * qq;
        q[(i, Q)] = s * qp + c * qq;
    }
}
