//! The LKJ distribution of correlation matrices, over their Cholesky factors.

use rand::Rng;

use super::factor::Factor;
use super::lkj::Lkj;
use super::size::{Fixed, Free};
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown};
use crate::number::scalar::Scalar;
use crate::term::accumulator::Accumulator;

/// LKJ distribution of the Cholesky factor L of a K×K correlation matrix R = L Lᵀ, with p(R) ∝ det(R)^(η − 1).
///
/// ln p(L) = ln c_K + Σᵢ (K − i + 2η − 2) ln Lᵢᵢ for η > 0, where i = 2 … K is counted from 1, and ln c_K = (K−1) ln
/// Γ(η + (K−1)/2) − Σₖ [(k/2) ln π + ln Γ(η + (K−1−k)/2)] with k = 1 … K−1. Each correlation has a beta distribution on
/// (−1, 1) with both shapes equal to η − 1 + K/2. The distribution with η = 1 is uniform over correlation matrices. For
/// a size K that is known only at run time, use [`LkjCholesky::of(k, eta)`](LkjCholesky::of).
///
/// # Coordinates
/// For row i and column j < i, both counted from 0, the coordinate x gives y = x/√(2 bⱼ) with bⱼ = η + (K − 2 − j)/2.
/// The partial correlation is zᵢⱼ = tanh yᵢⱼ, and Lᵢⱼ = zᵢⱼ Πₖ﹤ⱼ sech yᵢₖ. The density times the Jacobian is a product
/// over the coordinates, with the logarithm Σ [−2 bⱼ ln cosh yᵢⱼ − ln B(½, bⱼ) − ½ ln 2bⱼ]. Prior draws are therefore
/// exact, and no difference such as 1 − Σ L² is computed. Because of the scale √(2 bⱼ), every x is approximately
/// standard normal, even for K = 40.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let identity = CholeskyFactor::new([[1.0, 0.0], [0.0, 1.0]])?;
/// let uniform: f64 = LkjCholesky::<2>(1.0).ln_density(&identity);
/// assert!((uniform - 0.5f64.ln()).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Lewandowski, Kurowicka & Joe (2009), doi:10.1016/j.jmva.2009.04.008.
#[derive(Clone, Copy, Debug)]
pub struct LkjCholesky<const K: usize>(pub f64);

/// Version of [`LkjCholesky`] for a size known only at run time; created by [`LkjCholesky::of`].
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// The number of quantities is the length of the rows of the data.
///     fn correlated(rows: &[Vec<f64>]) {
///         let k = rows.first().map_or(0, Vec::len);
///         let mean ~ Normal(0.0, 10.0).iid(k);
///         let sd ~ HalfNormal(1.0).iid(k);
///         let corr ~ LkjCholesky::of(k, 2.0);
///         let chol = corr.scale_rows(&sd)?;
///         for y in rows {
///             y ~ MvNormalCholesky(&mean, &chol);
///         }
///     }
/// }
/// let rows = [vec![0.3, 1.2, -0.4], vec![0.1, 0.9, 0.2]];
/// let model = correlated(&rows);
/// assert_eq!(model.layout()?.dim, 3 + 3 + 3);
/// # Ok::<(), ppl::ModelError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DynLkjCholesky(Lkj<Free>);

impl LkjCholesky<0> {
    /// LKJ distribution of factors with `size` rows, for sizes known only at run time: `LkjCholesky::of(k, 2.0)`.
    pub fn of(size: usize, eta: f64) -> DynLkjCholesky {
        DynLkjCholesky(Lkj { eta, size: Free(size) })
    }
}

/// Implements the distribution for a size that is known at compile time, or only at run time.
macro_rules! impl_lkj {
    ([$($generics:tt)*] $Name:ty, $Size:ty, |$this:ident| $lkj:expr) => {
        impl<$($generics)*> $Name {
            #[inline(always)]
            fn lkj(&self) -> Lkj<$Size> {
                let $this = self;
                $lkj
            }
        }

        impl<$($generics)*> Family for $Name {}

        impl<R: Scalar, $($generics)*> Distribution<R> for $Name {
            type Value = Factor<R, $Size>;

            fn add_terms(&self, factor: &Self::Value, terms: &mut impl Accumulator<R>) {
                terms.add_number(self.lkj().ln_density(factor));
            }

            fn validate(&self) -> Result<(), DomainError> {
                DomainError::require_positive("LkjCholesky", "eta", self.lkj().eta)
            }

            fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
                self.lkj().draw(rng)
            }
        }

        impl<R: Scalar, $($generics)*> Unknown<R> for $Name {
            fn dim(&self) -> usize {
                self.lkj().dim()
            }

            #[inline(always)]
            fn constrain(
                &self,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl Accumulator<R>,
            ) -> Self::Value {
                self.lkj().constrain(next, jacobian, terms)
            }

            fn unconstrain(&self, factor: &Self::Value, out: &mut Vec<f64>) {
                self.lkj().unconstrain(factor, out);
            }
        }
    };
}
impl_lkj!([const K: usize] LkjCholesky<K>, Fixed<K>, |this| Lkj { eta: this.0, size: Fixed });
impl_lkj!([] DynLkjCholesky, Free, |this| this.0);
