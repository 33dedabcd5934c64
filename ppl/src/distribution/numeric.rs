//! What real numbers and counts have in common: intervals with probabilities.

use rand::Rng;

use super::{Distribution, Interval};
use crate::scalar::Scalar;

/// A distribution of one number, real or count: what `.truncate` and `.censor` are built on.
///
/// [`univariate!`](crate::univariate) and [`count!`](crate::count) implement it.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a distribution of one number",
    note = "`.truncate` and `.censor` are for real numbers and counts, before `.iid` and `.array`"
)]
pub trait Numeric<R: Scalar>: Distribution<R> {
    /// See [`UnivariateDensity::CONSTANT`](crate::UnivariateDensity::CONSTANT).
    #[doc(hidden)]
    const CONSTANT: bool = false;

    /// ln P(X ∈ interval), with its derivatives in the parameters.
    fn ln_probability(&self, interval: Interval) -> R;

    /// An exact draw of X given that it lies in the interval.
    fn draw_within<G: Rng + ?Sized>(&self, interval: Interval, rng: &mut G) -> Self::Value;

    /// The value as a number.
    fn number(x: &Self::Value) -> f64;

    /// Whether the value lies in the interval.
    fn is_within(x: &Self::Value, interval: &Interval) -> bool;

    /// The value moved to the nearest one that is not between an end of the interval and the
    /// inside.
    fn clamp(x: Self::Value, interval: &Interval) -> Self::Value;
}
