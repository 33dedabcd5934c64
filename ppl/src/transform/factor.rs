//! Cholesky factors of correlation and covariance matrices.

use crate::distribution::{Angles, CholeskyFactor};
use crate::scalar::Scalar;
use crate::special::Hyperbolic;

/// Cholesky factors of K×K correlation matrices, from K(K − 1)/2 coordinates, row by row.
///
/// For row i > column j: zᵢⱼ = tanh yᵢⱼ is a partial correlation, Lᵢⱼ = zᵢⱼ Πₖ﹤ⱼ sech yᵢₖ and
/// Lᵢᵢ = Πₖ﹤ᵢ sech yᵢₖ. In terms of the entries below the diagonal,
/// log|J| = −Σ (i − j + 1) ln cosh yᵢⱼ: nothing like 1 − Σ L² is formed.
///
/// # Example
/// ```
/// use ppl::{CholeskyFactor, transform::Correlation};
///
/// let mut next = [0.5f64, -0.2, 1.0].into_iter();
/// let (factor, _): (CholeskyFactor<f64, 3>, f64) =
///     Correlation.constrain(&mut || next.next().unwrap());
/// assert!((factor.covariance()[2][2] - 1.0).abs() < 1e-15);
/// assert_eq!(factor.get(1, 0), 0.5f64.tanh());
/// ```
///
/// # References
/// Lewandowski, Kurowicka & Joe (2009), doi:10.1016/j.jmva.2009.04.008.
#[derive(Clone, Copy, Debug)]
pub struct Correlation;

impl Correlation {
    /// The factor at the next coordinates, and the log-Jacobian.
    pub fn constrain<R: Scalar, const K: usize>(
        &self,
        next: &mut impl FnMut() -> R,
    ) -> (CholeskyFactor<R, K>, R) {
        let mut log_jacobian = R::from(0.0);
        let mut x = [[R::from(0.0); K]; K];
        let mut angles = Angles::zero();
        for i in 0..K {
            for j in 0..i {
                x[i][j] = next();
                let weight = (i - j + 1) as f64;
                let at = Hyperbolic::at(x[i][j].value());
                log_jacobian -= x[i][j].unary(weight * at.ln_cosh(), weight * at.tanh);
                angles.set(i, j, at, 1.0);
            }
        }
        let factor = CholeskyFactor::from_rows(angles.unfold(&x, (R::from(0.0), [0.0; K])));
        (factor, log_jacobian)
    }

    /// The coordinates of `factor`: sinh yᵢⱼ = Lᵢⱼ/|(Lᵢ,ⱼ₊₁ … Lᵢᵢ)|.
    pub fn unconstrain<R: Scalar, const K: usize>(
        &self,
        factor: &CholeskyFactor<R, K>,
        out: &mut Vec<f64>,
    ) {
        for (i, row) in factor.rows().iter().enumerate() {
            for j in 0..i {
                let rest: f64 = row[j + 1..=i].iter().map(|x| x.value().powi(2)).sum();
                out.push((row[j].value() / rest.sqrt()).asinh());
            }
        }
    }
}

/// Cholesky factors of K×K covariance matrices, from K(K + 1)/2 coordinates, row by row.
///
/// Lᵢᵢ = exp yᵢᵢ, Lᵢⱼ = yᵢⱼ below the diagonal; log|J| = Σ yᵢᵢ.
///
/// # Example
/// ```
/// use ppl::{CholeskyFactor, transform::Covariance};
///
/// let mut next = [0.0f64, -0.2, 0.0].into_iter();
/// let (factor, log_jacobian): (CholeskyFactor<f64, 2>, f64) =
///     Covariance.constrain(&mut || next.next().unwrap());
/// assert_eq!((factor, log_jacobian), (CholeskyFactor::new([[1.0, 0.0], [-0.2, 1.0]])?, 0.0));
/// # Ok::<(), ppl::DomainError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Covariance;

impl Covariance {
    /// The factor at the next coordinates, and the log-Jacobian.
    pub fn constrain<R: Scalar, const K: usize>(
        &self,
        next: &mut impl FnMut() -> R,
    ) -> (CholeskyFactor<R, K>, R) {
        let mut log_jacobian = R::from(0.0);
        let factor = CholeskyFactor::from_fn(|i, j| {
            let y = next();
            if i == j {
                log_jacobian += y;
                y.exp()
            } else {
                y
            }
        });
        (factor, log_jacobian)
    }

    /// The coordinates of `factor`.
    pub fn unconstrain<R: Scalar, const K: usize>(
        &self,
        factor: &CholeskyFactor<R, K>,
        out: &mut Vec<f64>,
    ) {
        for (i, row) in factor.rows().iter().enumerate() {
            out.extend(row[..i].iter().map(|x| x.value()));
            out.push(row[i].value().ln());
        }
    }
}
