//! Traits of distributions in models.

use rand::Rng;

use super::family::Family;
use crate::density::DomainError;
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};
use crate::term::accumulator::{Accumulator, Joined, Settled};
use crate::term::parameter::Parameter;

/// A distribution of values of type `Value`, with density and draws.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a distribution",
    label = "the right-hand side of `~` must be a distribution such as `Normal(0.0, 1.0)`"
)]
pub trait Distribution<R: Scalar>: Family {
    /// Type of the values: a number, a count, a flag, an array, a vector or a Cholesky factor.
    type Value: Clone + Recordable;

    /// Adds the terms of the log density (log probability for counts) at `x` to `terms`, with the partial derivatives
    /// of each term. The log density is −∞ outside the support and NaN for invalid parameters. A log density that is
    /// already a scalar is added by [`add_number`](Accumulator::add_number).
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>);

    /// Log density (log probability for counts) at `x`.
    #[must_use = "to add the value to the density of a model, write `factor(…);`"]
    #[inline(always)]
    fn ln_density(&self, x: &Self::Value) -> R {
        Joined::of(|terms| self.add_terms(x, terms))
    }

    /// Whether the distribution has sufficient statistics for several data with the same parameters.
    #[doc(hidden)]
    const HAS_STATISTICS: bool = false;

    /// Appends the sufficient statistics of `data`.
    #[doc(hidden)]
    fn sufficient_statistics(data: impl Iterator<Item = Self::Value>, out: &mut Vec<f64>) {
        let _ = (data, out);
    }

    /// Adds the log densities of the data with the given sufficient statistics.
    #[doc(hidden)]
    fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
        let _ = statistics;
        terms.add_number(R::from(f64::NAN));
    }

    /// Whether one observation contains many data, whose statistics are computed once, when the data are bound.
    #[doc(hidden)]
    const SUMMARISES: bool = false;

    /// Appends the statistics of one observation. The statistics depend on `x` and on the data in the distribution,
    /// but not on unknowns.
    #[doc(hidden)]
    fn summarise(&self, x: &Self::Value, out: &mut Vec<f64>) {
        let _ = (x, out);
    }

    /// Appends the log density of each part of `x` that cross-validation can leave out.
    #[doc(hidden)]
    fn pointwise(&self, x: &Self::Value, out: &mut Vec<f64>) {
        let mut terms = Settled::new();
        self.add_terms(x, &mut terms);
        out.push(terms.total());
    }

    /// Checks that `x` has the size that the distribution requires.
    ///
    /// # Errors
    /// [`DomainError`] with both sizes.
    #[doc(hidden)]
    fn fits(&self, x: &Self::Value) -> Result<(), DomainError> {
        let _ = x;
        Ok(())
    }

    /// Checks that the parameters are valid.
    ///
    /// # Errors
    /// [`DomainError`] with distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// Draws exactly from the distribution; the value has no derivatives. The value lies inside the open support: a
    /// draw that underflows to an end of the support, or overflows, is replaced by the nearest number inside the
    /// support. For invalid parameters, the value can be NaN; [`try_draw`](Distribution::try_draw) returns an error
    /// instead.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value;

    /// Version of [`draw`](Distribution::draw) for parameters that can be invalid.
    ///
    /// # Errors
    /// [`DomainError`] if a parameter is invalid, or if the draw is NaN for valid parameters.
    fn try_draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Result<Self::Value, DomainError> {
        self.validate()?;
        let value = self.draw(rng);
        let mut elements = Vec::new();
        value.flatten(&mut elements);
        match elements.into_iter().find(|x| x.is_nan()) {
            Some(x) => Err(DomainError::unmet(name::<Self>(), "draw", "a number", x)),
            None => Ok(value),
        }
    }
}

/// Returns the name of a type, without modules and type parameters.
fn name<T>() -> &'static str {
    let path = std::any::type_name::<T>();
    let end = path.find('<').unwrap_or(path.len());
    path[..end].rsplit("::").next().unwrap_or(path)
}

/// A distribution that can be the prior of an unknown: it maps unconstrained coordinates to values.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the distribution of an unknown",
    label = "has no smooth map from unconstrained space",
    note = "a discrete distribution can only be observed: write `place ~ D` without `let`",
    note = "marginalise a discrete unknown with `Mixture` or `factor(ln_sum_exp(…))`"
)]
pub trait Unknown<R: Scalar>: Distribution<R> {
    /// Number of unconstrained coordinates.
    fn dim(&self) -> usize;

    /// Maps the next coordinates to a value. Adds the log density of the value to `terms`, and the log-Jacobian of
    /// the map if `jacobian` is true. Terms of the log density that cancel with the log-Jacobian are omitted.
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Self::Value;

    /// Version of [`constrain`](Unknown::constrain) for n independent values.
    #[doc(hidden)]
    #[inline(always)]
    fn constrain_all(
        &self,
        n: usize,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Vec<Self::Value> {
        (0..n).map(|_| self.constrain(next, jacobian, terms)).collect()
    }

    /// Appends the unconstrained coordinates of `x`, the inverse of [`constrain`](Unknown::constrain).
    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>);

    /// Bounds at which a prior can truncate the posterior, the same for every element. The bounds are the ends of the
    /// support if both ends are finite and not natural bounds of the quantity. For a prior with known parameters that
    /// was truncated at one finite end, this end is a bound. Otherwise `None`.
    fn bounds(&self) -> Option<(f64, f64)> {
        None
    }
}

/// Converts a parameter to the scalar type of the model.
#[inline(always)]
pub(crate) fn lift<R>(parameter: impl Datum<R>) -> R {
    parameter.lift()
}

/// Returns `part(parameter)`, a term of a log density that depends only on `parameter`; 0 if the parameter is
/// constant and the accumulator omits constants.
#[inline(always)]
pub(crate) fn normaliser<R: Scalar, P: Parameter + Datum<R>>(
    terms: &impl Accumulator<R>,
    parameter: P,
    part: impl FnOnce(f64) -> f64,
) -> f64 {
    if P::CONSTANT && terms.leave_out_constants() { 0.0 } else { part(parameter.number()) }
}
