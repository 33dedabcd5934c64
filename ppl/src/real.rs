//! The numbers in the body of a model.

use crate::record::Record;
use crate::scalar::{Scalar, impl_arithmetic};

/// A number in the body of a model, over whatever kind of number the reading needs.
///
/// A body is generic code. Over a bare type parameter `2.0 * x` would not resolve without
/// `where` clauses that spoil the inference of every other float; over this one type the
/// operators are ordinary implementations.
#[derive(Clone, Copy, Debug)]
pub struct Real<S>(pub(crate) S);

impl<S: Scalar> From<f64> for Real<S> {
    #[inline]
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

    #[inline]
    fn value(self) -> f64 {
        self.0.value()
    }

    #[inline]
    fn is_constant(self) -> bool {
        self.0.is_constant()
    }

    #[inline]
    fn fuse_iter(value: f64, arguments: impl IntoIterator<Item = (Self, f64)>) -> Self {
        Self(S::fuse_iter(value, arguments.into_iter().map(|(x, partial)| (x.0, partial))))
    }

    #[inline]
    fn unary(self, value: f64, derivative: f64) -> Self {
        Self(self.0.unary(value, derivative))
    }
}

impl<S: Scalar> Record for Real<S> {
    fn shape(&self) -> Vec<usize> {
        Vec::new()
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        out.push(self.value());
    }
}
