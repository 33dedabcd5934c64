//! Multivariate normal distribution, parametrised by the Cholesky factor of its covariance.

use rand::Rng;
use rand_distr::StandardNormal;

use super::factor::Factor;
use super::mv_normal_terms::{add_statistics_terms, add_terms, sufficient_statistics};
use super::size::{MatrixEntry, Size};
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown};
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};
use crate::term::accumulator::Accumulator;

/// Multivariate normal distribution with mean μ ∈ ℝᴷ and covariance L Lᵀ.
///
/// ln p(x) = −½ |L⁻¹(x − μ)|² − Σᵢ ln Lᵢᵢ − (K/2) ln 2π, for Lᵢᵢ > 0.
///
/// If L is a [`CholeskyFactor`](super::CholeskyFactor) of numbers or unknowns, mean and values are arrays. If L is a
/// [`DynCholeskyFactor`](super::DynCholeskyFactor), the mean is a slice or a `Vec`. Mean and factor can be
/// references.
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

/// Scale of a [`MvNormalCholesky`]: a Cholesky factor with a size known at compile time or at run time.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a Cholesky factor of a covariance matrix",
    label = "expected a `CholeskyFactor`, a `DynCholeskyFactor`, or a reference to one"
)]
pub trait Scale<R: Scalar>: Clone {
    /// Type of the size.
    type Size: Size;

    /// Returns the factor, converted to the scalar type of the model.
    fn factor(&self) -> Factor<R, Self::Size>;
}

impl<R: Scalar, T: Datum<R> + MatrixEntry, S: Size> Scale<R> for Factor<T, S> {
    type Size = S;

    #[inline(always)]
    fn factor(&self) -> Factor<R, S> {
        self.lifted()
    }
}

impl<R: Scalar, L: Scale<R>> Scale<R> for &L {
    type Size = L::Size;

    #[inline(always)]
    fn factor(&self) -> Factor<R, L::Size> {
        (**self).factor()
    }
}

/// Type of the means and values of a normal distribution with the scale `L`.
pub(super) type Vector<R, L> = <<L as Scale<R>>::Size as Size>::Vector<R>;

const NAME: &str = "MvNormalCholesky";

/// Checks that the length of a vector equals the number of rows of the factor.
pub(super) fn require_length(
    name: &'static str,
    what: &'static str,
    length: usize,
    rows: usize,
) -> Result<(), DomainError> {
    let requirement = format_args!("equal to the number of rows of the factor, {rows}");
    DomainError::require(length == rows, name, what, requirement, length as f64)
}

/// Checks that all entries of the mean are finite.
pub(super) fn require_finite_mean<R: Scalar>(
    name: &'static str,
    mean: &[R],
) -> Result<(), DomainError> {
    for (i, mean) in mean.iter().enumerate() {
        DomainError::require_finite(name, format_args!("mean[{i}]"), mean.value())?;
    }
    Ok(())
}

impl<R, M, L> Distribution<R> for MvNormalCholesky<M, L>
where
    R: Scalar,
    L: Scale<R>,
    M: Datum<Vector<R, L>> + Clone,
{
    type Value = Vector<R, L>;

    #[inline(always)]
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>) {
        let (factor, mean) = (self.1.factor(), self.0.lift());
        if x.as_ref().len() != factor.size() || mean.as_ref().len() != factor.size() {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        add_terms(x, mean, factor, terms);
    }

    const HAS_STATISTICS: bool = true;

    fn sufficient_statistics(data: impl Iterator<Item = Self::Value>, out: &mut Vec<f64>) {
        sufficient_statistics(data.map(|x| x.as_ref().iter().map(|x| x.value()).collect()), out);
    }

    #[inline(always)]
    fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
        let (factor, mean) = (self.1.factor(), self.0.lift());
        if mean.as_ref().len() != factor.size() {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        add_statistics_terms(statistics, mean, factor, terms);
    }

    fn validate(&self) -> Result<(), DomainError> {
        let (factor, mean) = (self.1.factor(), self.0.lift());
        require_length(NAME, "length of the mean", mean.as_ref().len(), factor.size())?;
        require_finite_mean(NAME, mean.as_ref())?;
        factor.validate(NAME)
    }

    fn fits(&self, x: &Self::Value) -> Result<(), DomainError> {
        require_length(NAME, "length of x", x.as_ref().len(), self.1.factor().size())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
        let (factor, mean) = (self.1.factor(), self.0.lift());
        let l = factor.values();
        let z: Vec<f64> = (0..factor.size()).map(|_| rng.sample(StandardNormal)).collect();
        factor.size.vector(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * z[j]).sum();
            R::from(mean[i].value() + inner)
        })
    }
}

impl<R, M, L> Unknown<R> for MvNormalCholesky<M, L>
where
    R: Scalar,
    L: Scale<R>,
    M: Datum<Vector<R, L>> + Clone,
{
    fn dim(&self) -> usize {
        self.1.factor().size()
    }

    #[inline]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Self::Value {
        let x = self.1.factor().size.vector(|_| next());
        self.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
        x.flatten(out);
    }
}
