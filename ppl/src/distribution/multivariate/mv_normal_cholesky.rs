//! The multivariate normal distribution, by the Cholesky factor of its covariance.

use rand::Rng;

use crate::accumulator::{Accumulator, Joined};
use crate::datum::{Datum, Recordable};
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown};
use crate::scalar::Scalar;

/// Multivariate normal distribution with mean μ ∈ ℝᴷ and covariance L Lᵀ.
///
/// ln p(x) = −½ |L⁻¹(x − μ)|² − Σᵢ ln Lᵢᵢ − (K/2) ln 2π, for Lᵢᵢ > 0.
///
/// The factor is a [`CholeskyFactor`](super::CholeskyFactor) of numbers or unknowns, and the mean an array, as values are; or
/// a [`DynCholeskyFactor`](super::DynCholeskyFactor), and the mean a slice or `Vec`. Both may be behind
/// references. An evaluation is one fused operation, with z = L⁻¹(x − μ), w = L⁻ᵀ z and partials −w
/// in x, w in μ and wᵢ zⱼ − δᵢⱼ/Lᵢᵢ in Lᵢⱼ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let factor = CholeskyFactor::new([[2.0, 0.0], [0.0, 3.0]])?;
/// let joint: f64 = MvNormalCholesky([1.0, -1.0], factor).ln_density(&[0.5, 0.0]);
/// let product = Normal(1.0, 2.0).ln_density(&0.5) + Normal(-1.0, 3.0).ln_density(&0.0);
/// assert!((joint - product).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Kotz, Balakrishnan & Johnson (2000), *Continuous Multivariate Distributions*, vol. 1, ch. 45.
#[derive(Clone, Copy, Debug)]
pub struct MvNormalCholesky<M, L>(pub M, pub L);

impl<M: Clone, L: Clone> Family for MvNormalCholesky<M, L> {}

/// The scale of a [`MvNormalCholesky`]: a factor whose size is in its type or comes from the data.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a Cholesky factor of a covariance matrix",
    label = "needed: a `CholeskyFactor` or a `DynCholeskyFactor`, or a reference to one"
)]
pub trait Scale<R: Scalar>: Clone {
    /// Means and values: an array, or a `Vec` where the size comes from the data.
    type Vector: Clone + Recordable;

    /// Number of rows.
    fn size(&self) -> usize;

    /// Adds the log density at `x`.
    fn add_terms(&self, mean: &Self::Vector, x: &Self::Vector, terms: &mut impl Accumulator<R>);

    /// Whether mean and factor are of one size, and those of a normal distribution.
    ///
    /// # Errors
    /// [`DomainError`] naming the entry at fault.
    fn validate(&self, mean: &Self::Vector) -> Result<(), DomainError>;

    /// Whether a value has as many entries as the factor has rows.
    ///
    /// # Errors
    /// [`DomainError`] that says both.
    fn fits(&self, x: &Self::Vector) -> Result<(), DomainError> {
        let _ = x;
        Ok(())
    }

    /// A draw.
    fn draw<G: Rng + ?Sized>(&self, mean: &Self::Vector, rng: &mut G) -> Self::Vector;

    /// The next coordinates.
    fn collect(&self, next: &mut impl FnMut() -> R) -> Self::Vector;

    /// See [`Distribution::HAS_STATISTICS`].
    #[doc(hidden)]
    const HAS_STATISTICS: bool = false;

    /// See [`Distribution::sufficient_statistics`].
    #[doc(hidden)]
    fn sufficient_statistics(data: impl Iterator<Item = Self::Vector>, sums: &mut Vec<f64>) {
        let _ = (data, sums);
    }

    /// See [`Distribution::add_pooled_terms`].
    #[doc(hidden)]
    fn add_pooled_terms(&self, mean: &Self::Vector, sums: &[f64], terms: &mut impl Accumulator<R>) {
        let _ = (mean, sums);
        terms.add_number(R::from(f64::NAN));
    }
}

impl<R: Scalar, L: Scale<R>> Scale<R> for &L {
    type Vector = L::Vector;
    const HAS_STATISTICS: bool = L::HAS_STATISTICS;

    fn size(&self) -> usize {
        (**self).size()
    }

    #[inline(always)]
    fn add_terms(&self, mean: &L::Vector, x: &L::Vector, terms: &mut impl Accumulator<R>) {
        (**self).add_terms(mean, x, terms);
    }

    fn validate(&self, mean: &L::Vector) -> Result<(), DomainError> {
        (**self).validate(mean)
    }

    fn fits(&self, x: &L::Vector) -> Result<(), DomainError> {
        (**self).fits(x)
    }

    fn draw<G: Rng + ?Sized>(&self, mean: &L::Vector, rng: &mut G) -> L::Vector {
        (**self).draw(mean, rng)
    }

    #[inline(always)]
    fn collect(&self, next: &mut impl FnMut() -> R) -> L::Vector {
        (**self).collect(next)
    }

    fn sufficient_statistics(data: impl Iterator<Item = L::Vector>, sums: &mut Vec<f64>) {
        L::sufficient_statistics(data, sums);
    }

    #[inline(always)]
    fn add_pooled_terms(&self, mean: &L::Vector, sums: &[f64], terms: &mut impl Accumulator<R>) {
        (**self).add_pooled_terms(mean, sums, terms);
    }
}

impl<R, M, L> Distribution<R> for MvNormalCholesky<M, L>
where
    R: Scalar,
    L: Scale<R>,
    M: Datum<L::Vector> + Clone,
{
    type Value = L::Vector;

    #[inline]
    fn ln_density(&self, x: &L::Vector) -> R {
        Joined::of(|terms| self.add_terms(x, terms))
    }

    #[inline(always)]
    fn add_terms(&self, x: &L::Vector, terms: &mut impl Accumulator<R>) {
        self.1.add_terms(&self.0.lift(), x, terms);
    }

    const HAS_STATISTICS: bool = L::HAS_STATISTICS;

    fn sufficient_statistics(data: impl Iterator<Item = L::Vector>, sums: &mut Vec<f64>) {
        L::sufficient_statistics(data, sums);
    }

    #[inline(always)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Accumulator<R>) {
        self.1.add_pooled_terms(&self.0.lift(), sums, terms);
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.1.validate(&self.0.lift())
    }

    fn fits(&self, x: &L::Vector) -> Result<(), DomainError> {
        self.1.fits(x)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> L::Vector {
        self.1.draw(&self.0.lift(), rng)
    }
}

impl<R, M, L> Unknown<R> for MvNormalCholesky<M, L>
where
    R: Scalar,
    L: Scale<R>,
    M: Datum<L::Vector> + Clone,
{
    fn dim(&self) -> usize {
        self.1.size()
    }

    #[inline]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Accumulator<R>,
    ) -> L::Vector {
        let x = self.1.collect(next);
        self.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &L::Vector, out: &mut Vec<f64>) {
        x.flatten(out);
    }
}
