//! Accumulators of log density terms.

use crate::number::partials::Partials;
use crate::number::scalar::Scalar;

/// Accumulator of the terms of a log density. Each term is a value with its partial derivatives.
///
/// A density passes its terms one by one to the accumulator. [`Joined`] adds the terms to one scalar. [`Settled`]
/// adds the values, propagates the partial derivatives to the adjoints immediately, and stores no terms.
pub trait Accumulator<R: Scalar> {
    /// Adds a term with the given value and partial derivatives.
    fn add(&mut self, value: f64, partials: impl Partials<R>);

    /// Adds a term that is already a scalar.
    fn add_number(&mut self, term: R);

    /// Returns a number with the given value and with the derivative `slope` with respect to `y`. The number can
    /// replace `y` on the tape, so the caller must not use `y` afterwards.
    #[inline(always)]
    fn replace(&mut self, y: R, value: f64, slope: f64) -> R {
        y.unary(value, slope)
    }

    /// Returns −ln x for the following term. An accumulator can instead return 0 and add the logarithm later: it
    /// multiplies the arguments x of several calls and takes one logarithm of the product.
    #[inline(always)]
    fn minus_ln(&mut self, x: f64) -> f64 {
        -x.ln()
    }

    /// Whether terms that have the same value at every point of the parameter space can be omitted.
    #[inline(always)]
    fn leave_out_constants(&self) -> bool {
        false
    }
}

/// Accumulator that adds all terms to one scalar with derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Joined<R>(Option<R>);

impl<R> Default for Joined<R> {
    fn default() -> Self {
        Self(None)
    }
}

impl<R: Scalar> Joined<R> {
    /// Returns the sum of the terms that `density` adds.
    #[inline(always)]
    pub fn of(density: impl FnOnce(&mut Self)) -> R {
        Self::with(density).1
    }

    /// Returns the return value of `density`, and the sum of the terms that `density` adds.
    #[inline(always)]
    pub fn with<T>(density: impl FnOnce(&mut Self) -> T) -> (T, R) {
        let mut terms = Self::default();
        let value = density(&mut terms);
        (value, terms.number())
    }

    /// Returns the sum of the added terms; 0 if no terms were added.
    #[inline(always)]
    pub(crate) fn number(self) -> R {
        self.0.unwrap_or_else(|| R::from(0.0))
    }
}

impl<R: Scalar> Accumulator<R> for Joined<R> {
    #[inline(always)]
    fn add(&mut self, value: f64, partials: impl Partials<R>) {
        self.add_number(R::gather(value, partials));
    }

    #[inline(always)]
    fn add_number(&mut self, term: R) {
        self.0 = Some(self.0.map_or(term, |total| total + term));
    }
}

/// Accumulator that adds the values of the terms and propagates their partial derivatives to the adjoints immediately.
///
/// With `drop_constants`, terms that have the same value at every point of the parameter space are omitted.
/// [`Bound`](crate::Bound) adds the sum of the omitted terms to the log density.
#[derive(Clone, Copy, Debug)]
pub struct Settled {
    value: f64,
    /// Product of deferred divisors: the total is `value` − ln(`product`).
    product: f64,
    drop_constants: bool,
}

impl Settled {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { value: 0.0, product: 1.0, drop_constants: false }
    }

    /// Returns the sum of the values of all added terms, without derivatives.
    #[inline(always)]
    pub(crate) fn total(&self) -> f64 {
        self.value - self.product.ln()
    }

    #[inline(always)]
    pub(crate) fn is_finite(&self) -> bool {
        // the field `product` is always finite, so the sum is finite if `value` is finite
        self.value.is_finite()
    }

    /// Adds the sum of another accumulator.
    #[inline(always)]
    pub(crate) fn add_all(&mut self, others: Self) {
        self.value += others.value;
        if self.product == 1.0 {
            self.product = others.product;
        } else if others.product != 1.0 {
            self.value += self.divide(others.product);
        }
    }

    /// Multiplies the field `product` by x and returns 0. If the new product would be near overflow or underflow,
    /// resets `product` to 1 and returns minus the logarithm of the new product instead.
    #[inline(always)]
    fn divide(&mut self, x: f64) -> f64 {
        let product = self.product * x;
        if (1e-200..1e200).contains(&product) {
            self.product = product;
            return 0.0;
        }
        let before = std::mem::replace(&mut self.product, 1.0);
        -before.ln() - x.ln()
    }
}

impl<R: Scalar> Accumulator<R> for Settled {
    #[inline(always)]
    fn add(&mut self, value: f64, partials: impl Partials<R>) {
        self.value += value;
        if R::DIFFERENTIABLE {
            partials.settle(&mut |argument: R, partial| argument.deposit(partial));
        }
    }

    #[inline(always)]
    fn add_number(&mut self, term: R) {
        self.value += term.value();
        term.deposit(1.0);
    }

    #[inline(always)]
    fn replace(&mut self, y: R, value: f64, slope: f64) -> R {
        y.replaced(value, slope)
    }

    #[inline(always)]
    fn minus_ln(&mut self, x: f64) -> f64 {
        self.divide(x)
    }

    #[inline(always)]
    fn leave_out_constants(&self) -> bool {
        self.drop_constants
    }
}

/// Accumulator of all terms of one statement.
pub(crate) trait Statement<R: Scalar>: Accumulator<R> + Copy {
    /// Creates an empty accumulator. With `drop_constants`, terms that have the same value at every point of the
    /// parameter space are omitted if the type supports the omission.
    fn empty(drop_constants: bool) -> Self;

    /// Returns an accumulator that adds the terms of all observations in a loop to `total`; `None` if each
    /// observation needs a separate accumulator.
    fn within(total: &mut Settled) -> Option<&mut Self>;

    /// Returns the sum of the added terms.
    fn total(&self) -> f64;

    fn is_finite(&self) -> bool;
}

impl<R: Scalar> Statement<R> for Joined<R> {
    #[inline(always)]
    fn empty(_: bool) -> Self {
        Self::default()
    }

    #[inline(always)]
    fn within(_: &mut Settled) -> Option<&mut Self> {
        None
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        let total = self.number();
        if total.has_finite_slopes() { total.value() } else { f64::NAN }
    }

    /// Whether the sum of the terms and the derivatives stored with the sum are finite.
    #[inline(always)]
    fn is_finite(&self) -> bool {
        let total = self.number();
        total.value().is_finite() && total.has_finite_slopes()
    }
}

impl<R: Scalar> Statement<R> for Settled {
    #[inline(always)]
    fn empty(drop_constants: bool) -> Self {
        Self { drop_constants, ..Self::new() }
    }

    #[inline(always)]
    fn within(total: &mut Settled) -> Option<&mut Self> {
        Some(total)
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.total()
    }

    #[inline(always)]
    fn is_finite(&self) -> bool {
        self.is_finite()
    }
}

#[cfg(test)]
#[path = "../../tests/unit/accumulator.rs"]
mod tests;
