//! What a distribution offers to a model.

use rand::Rng;

use super::family::Family;
use crate::accumulator::{Accumulator, Joined, Settled};
use crate::datum::{Datum, Recordable};
use crate::density::DomainError;
use crate::parameter::Parameter;
use crate::scalar::Scalar;

/// What every distribution offers to a model: density and draws over values of type `Value`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a distribution",
    label = "the right-hand side of `~` must be a distribution such as `Normal(0.0, 1.0)`"
)]
pub trait Distribution<R: Scalar>: Family {
    /// A number, a count, a flag, an array, a vector or a Cholesky factor.
    type Value: Clone + Recordable;

    /// Adds the log density (log mass for counts) at `x`, term by term, each with its partials: −∞
    /// outside the support, NaN for parameters outside their domain. A density that is a number
    /// already goes to [`add_number`](Accumulator::add_number).
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>);

    /// Log density (log mass for counts) at `x`.
    #[must_use = "a model takes it by `factor(…);`"]
    #[inline(always)]
    fn ln_density(&self, x: &Self::Value) -> R {
        Joined::of(|terms| self.add_terms(x, terms))
    }

    /// Whether data that share their parameters have sufficient statistics.
    #[doc(hidden)]
    const HAS_STATISTICS: bool = false;

    /// Appends those of `data`.
    #[doc(hidden)]
    fn sufficient_statistics(data: impl Iterator<Item = Self::Value>, out: &mut Vec<f64>) {
        let _ = (data, out);
    }

    /// The terms of the log densities at the data with these sufficient statistics.
    #[doc(hidden)]
    fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
        let _ = statistics;
        terms.add_number(R::from(f64::NAN));
    }

    /// Whether one observation holds so many data that their statistics are found when it is bound.
    #[doc(hidden)]
    const SUMMARISES: bool = false;

    /// Appends the statistics of one observation: they depend on `x` and on what the distribution
    /// has of data, not on unknowns.
    #[doc(hidden)]
    fn summarise(&self, x: &Self::Value, out: &mut Vec<f64>) {
        let _ = (x, out);
    }

    /// The log density of what cross-validation may leave out of `x`, part by part, at the end of
    /// `out`.
    #[doc(hidden)]
    fn pointwise(&self, x: &Self::Value, out: &mut Vec<f64>) {
        let mut terms = Settled::new();
        self.add_terms(x, &mut terms);
        out.push(terms.total());
    }

    /// Whether `x` has the size that the distribution asks for.
    ///
    /// # Errors
    /// [`DomainError`] that says both sizes.
    #[doc(hidden)]
    fn fits(&self, x: &Self::Value) -> Result<(), DomainError> {
        let _ = x;
        Ok(())
    }

    /// Whether the parameters lie in their domain.
    ///
    /// # Errors
    /// [`DomainError`] naming distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// An exact draw, as constants of `R`, that lies inside the open support: one that underflows to
    /// an end, or overflows, is the nearest number inside. For parameters outside their domain it
    /// may be NaN; [`try_draw`](Distribution::try_draw) never is.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value;

    /// [`draw`](Distribution::draw) for parameters that may lie outside their domain.
    ///
    /// # Errors
    /// [`DomainError`] for such parameters, and for a draw that is NaN in spite of them.
    fn try_draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Result<Self::Value, DomainError> {
        self.validate()?;
        let value = self.draw(rng);
        let mut numbers = Vec::new();
        value.flatten(&mut numbers);
        match numbers.into_iter().find(|x| x.is_nan()) {
            Some(x) => Err(DomainError::unmet(name::<Self>(), "draw", "a number", x)),
            None => Ok(value),
        }
    }
}

/// The name of a type without the modules and parameters around it.
fn name<T>() -> &'static str {
    let path = std::any::type_name::<T>();
    let end = path.find('<').unwrap_or(path.len());
    path[..end].rsplit("::").next().unwrap_or(path)
}

/// A distribution whose values can be unknowns: it maps unconstrained coordinates to them.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the distribution of an unknown",
    label = "has no smooth map from unconstrained space",
    note = "a discrete distribution can only be observed: write `place ~ D` without `let`",
    note = "a discrete unknown must be summed out: by `Mixture`, or by `factor(ln_sum_exp(…))`"
)]
pub trait Unknown<R: Scalar>: Distribution<R> {
    /// Number of unconstrained coordinates.
    fn dim(&self) -> usize;

    /// The value at the next coordinates. Its log density goes to `terms`; `jacobian` adds the
    /// log-Jacobian of the map, in a form that cancels what can be cancelled.
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Self::Value;

    /// [`constrain`](Unknown::constrain) for n independent values.
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

    /// Appends the coordinates of `x`: the inverse of [`constrain`](Unknown::constrain).
    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>);

    /// The ends of the support that a prior may be said to cut at, the same for each element: two
    /// finite ones, if they are not the quantity's own, or a single one at which a constant prior was
    /// truncated.
    fn bounds(&self) -> Option<(f64, f64)> {
        None
    }
}

/// A parameter as a number of the model's kind.
#[inline(always)]
pub(crate) fn lift<R>(parameter: impl Datum<R>) -> R {
    parameter.lift()
}

/// A part of a log density that depends on `parameter` alone: left out where that may be.
#[inline(always)]
pub(crate) fn normaliser<R: Scalar, P: Parameter + Datum<R>>(
    terms: &impl Accumulator<R>,
    parameter: P,
    part: impl FnOnce(f64) -> f64,
) -> f64 {
    if P::CONSTANT && terms.leave_out_constants() { 0.0 } else { part(parameter.number()) }
}
