//! Scalars in the body of a model.

use crate::number::partials::Partials;
use crate::number::scalar::{Scalar, impl_arithmetic};
use crate::quantity::datum::Recordable;

/// A scalar in the body of a model, over the scalar type of the evaluation context.
///
/// The body of a model is generic code. If scalars had a bare type parameter as their type, `2.0 * x` would need
/// `where` clauses that break the type inference of float literals. For the wrapper type, the operators are ordinary
/// trait implementations.
#[derive(Clone, Copy, Debug)]
pub struct Real<S>(pub(crate) S);

/// Converts data, for example from an iterator over references.
impl<S: Scalar> From<&f64> for Real<S> {
    #[inline(always)]
    fn from(x: &f64) -> Self {
        Self::from(*x)
    }
}

impl<S: Scalar> From<f64> for Real<S> {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self(S::from(value))
    }
}

impl<S: Scalar> std::fmt::Display for Real<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.value().fmt(f)
    }
}

impl_arithmetic!([S: Scalar] Real<S>);

impl<S: Scalar> Scalar for Real<S> {
    const DIFFERENTIABLE: bool = S::DIFFERENTIABLE;

    #[inline(always)]
    fn value(self) -> f64 {
        self.0.value()
    }

    #[inline(always)]
    fn is_constant(self) -> bool {
        self.0.is_constant()
    }

    #[inline(always)]
    fn has_finite_slopes(self) -> bool {
        self.0.has_finite_slopes()
    }

    #[inline(always)]
    fn deposit(self, adjoint: f64) {
        self.0.deposit(adjoint);
    }

    #[inline(always)]
    fn replaced(self, value: f64, derivative: f64) -> Self {
        Self(self.0.replaced(value, derivative))
    }

    #[inline(always)]
    fn gather(value: f64, partials: impl Partials<Self>) -> Self {
        Self(S::gather(value, Bare(partials)))
    }

    #[inline(always)]
    fn fuse_all<const D: usize, const M: usize>(
        values: [f64; M],
        arguments: [Self; D],
        jacobian: [[f64; D]; M],
    ) -> [Self; M] {
        S::fuse_all(values, arguments.map(|argument| argument.0), jacobian).map(Self)
    }

    #[inline(always)]
    fn unary(self, value: f64, derivative: f64) -> Self {
        Self(self.0.unary(value, derivative))
    }
}

/// Partial derivatives with respect to `Real` scalars, converted to the wrapped scalars.
struct Bare<P>(P);

impl<S: Scalar, P: Partials<Real<S>>> Partials<S> for Bare<P> {
    const MOST: usize = P::MOST;

    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(S, f64)) {
        self.0.spread(&mut |argument, partial| f(argument.0, partial));
    }

    #[inline(always)]
    fn settle(self, f: &mut impl FnMut(S, f64)) {
        self.0.settle(&mut |argument, partial| f(argument.0, partial));
    }
}

impl<S: Scalar> Recordable for Real<S> {
    fn shape(&self) -> Vec<usize> {
        Vec::new()
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        out.push(self.value());
    }

    fn overwrite(&mut self, elements: &mut dyn Iterator<Item = f64>) -> bool {
        let number = elements.next();
        number.is_some_and(|number| {
            *self = Self::from(number);
            true
        })
    }
}
