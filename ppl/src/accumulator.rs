//! Accumulators of log density terms.

use crate::partials::Partials;
use crate::scalar::Scalar;

/// Accumulator of the terms of a log density, each with its partial derivatives.
///
/// A density passes its terms one by one, and the accumulator determines their use. [`Joined`] adds them to one scalar.
/// [`Settled`] adds the values, propagates the partial derivatives to the adjoints immediately, and stores no terms.
pub trait Accumulator<R: Scalar> {
    /// Adds a term with the given value and partial derivatives.
    fn add(&mut self, value: f64, partials: impl Partials<R>);

    /// Adds a term that is already a scalar.
    fn add_number(&mut self, term: R);

    /// Number with the given value and the given derivative with respect to `y`. The caller must not use `y`
    /// afterwards.
    #[inline(always)]
    fn replace(&mut self, y: R, value: f64, slope: f64) -> R {
        y.unary(value, slope)
    }

    /// Returns −ln x for the following term. An accumulator can return 0 and add the logarithm later, combined with
    /// others as the logarithm of a product.
    #[inline(always)]
    fn minus_ln(&mut self, x: f64) -> f64 {
        -x.ln()
    }

    /// Whether terms that are the same at every point can be omitted.
    #[inline(always)]
    fn leave_out_constants(&self) -> bool {
        false
    }
}

/// Accumulator of the sum as one scalar.
#[derive(Clone, Copy, Debug)]
pub struct Joined<R>(Option<R>);

impl<R> Default for Joined<R> {
    fn default() -> Self {
        Self(None)
    }
}

impl<R: Scalar> Joined<R> {
    /// Sum of the terms that `density` adds.
    #[inline(always)]
    pub fn of(density: impl FnOnce(&mut Self)) -> R {
        Self::with(density).1
    }

    /// Return value of `density`, and the sum of the terms that it adds.
    #[inline(always)]
    pub fn with<T>(density: impl FnOnce(&mut Self) -> T) -> (T, R) {
        let mut terms = Self::default();
        let value = density(&mut terms);
        (value, terms.number())
    }

    /// Sum of the terms.
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
/// With `drop_constants`, terms that are the same at every point are omitted, since samplers do not need them.
/// [`Bound`](crate::Bound) adds the sum of the omitted terms.
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

    /// Sum of the values.
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

    /// Multiplies the product by x and returns 0. If the new product would overflow or underflow, resets the product to
    /// 1 and returns minus its logarithm instead.
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
    /// Empty accumulator. With `drop_constants`, terms that are the same at every point are omitted if the type
    /// supports it.
    fn empty(drop_constants: bool) -> Self;

    /// Accumulator for observations in a loop that adds their terms to `total`; `None` if each observation needs its
    /// own.
    fn within(total: &mut Settled) -> Option<&mut Self>;

    /// Sum of the terms.
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

    /// Whether the value and the derivatives stored with the scalar are finite.
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
#[path = "../tests/unit/accumulator.rs"]
mod tests;
