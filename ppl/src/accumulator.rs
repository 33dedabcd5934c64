//! Where the summands of a log density go.

use crate::partials::Partials;
use crate::scalar::Scalar;

/// Takes the summands of a log density, each with its partial derivatives.
///
/// A density that hands over what it is the sum of, term by term, leaves open what becomes of them:
/// one number ([`Joined`]), or values and adjoints that are added up where they belong, with nothing
/// kept of the terms ([`Settled`]).
pub trait Accumulator<R: Scalar> {
    /// A summand with this value and these partials.
    fn add(&mut self, value: f64, partials: impl Partials<R>);

    /// A summand that is a number already.
    fn add_number(&mut self, term: R);

    /// The number with this value, and this slope in `y`, where nothing will use `y` any more.
    #[inline(always)]
    fn replace(&mut self, y: R, value: f64, slope: f64) -> R {
        y.unary(value, slope)
    }

    /// −ln x for a summand that follows, or 0 if it will be added later, together with others, as one
    /// logarithm of a product.
    #[inline(always)]
    fn minus_ln(&mut self, x: f64) -> f64 {
        -x.ln()
    }

    /// Whether what is the same at every point may be left out.
    #[inline(always)]
    fn leave_out_constants(&self) -> bool {
        false
    }
}

/// The sum as one number.
#[derive(Clone, Copy, Debug)]
pub struct Joined<R>(Option<R>);

impl<R> Default for Joined<R> {
    fn default() -> Self {
        Self(None)
    }
}

impl<R: Scalar> Joined<R> {
    /// What `density` adds up.
    #[inline(always)]
    pub fn of(density: impl FnOnce(&mut Self)) -> R {
        Self::with(density).1
    }

    /// What `density` returns, and what it adds up.
    #[inline(always)]
    pub fn with<T>(density: impl FnOnce(&mut Self) -> T) -> (T, R) {
        let mut terms = Self::default();
        let value = density(&mut terms);
        (value, terms.number())
    }

    /// The sum.
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

/// Values are added up; partials go straight to the adjoints of what they are in.
///
/// With `drop_constants` they leave out what is the same at every point: samplers need no more, and
/// [`Bound`](crate::Bound) adds the sum of what was left out.
#[derive(Clone, Copy, Debug)]
pub struct Settled {
    value: f64,
    /// What the value has to lose the logarithm of.
    product: f64,
    drop_constants: bool,
}

impl Settled {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { value: 0.0, product: 1.0, drop_constants: false }
    }

    /// The sum of the values.
    #[inline(always)]
    pub(crate) fn total(&self) -> f64 {
        self.value - self.product.ln()
    }

    #[inline(always)]
    pub(crate) fn is_finite(&self) -> bool {
        // the product always is
        self.value.is_finite()
    }

    /// Adds the sum of others.
    #[inline(always)]
    pub(crate) fn add_all(&mut self, others: Self) {
        self.value += others.value;
        if self.product == 1.0 {
            self.product = others.product;
        } else if others.product != 1.0 {
            self.value += self.divide(others.product);
        }
    }

    /// −ln x, or 0 if it could be left to the product.
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

/// All terms of a statement.
pub(crate) trait Statement<R: Scalar>: Accumulator<R> + Copy {
    /// None yet; with `drop_constants` what is the same at every point is left out, where that makes
    /// sense.
    fn empty(drop_constants: bool) -> Self;

    /// What takes the terms of observations in a loop, if they go to what it has summed up so far
    /// and not each by itself.
    fn within(total: &mut Settled) -> Option<&mut Self>;

    /// The sum.
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

    /// Whether value and derivatives are, as far as the number carries these.
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
