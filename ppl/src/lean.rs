//! Numbers of a density known up to a constant.

use crate::record::Record;
use crate::scalar::{Partials, Scalar, impl_arithmetic};

/// A number whose densities leave out what is the same at every point: normalisers of data.
///
/// Samplers need no more; [`Bound`](crate::Bound) adds the sum of what was left out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lean<S>(pub(crate) S);

impl<S: Scalar> From<f64> for Lean<S> {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self(S::from(value))
    }
}

impl_arithmetic!([S: Scalar] Lean<S>);

impl<S: Scalar> Scalar for Lean<S> {
    const DIFFERENTIABLE: bool = S::DIFFERENTIABLE;
    const LEAN: bool = true;

    #[inline(always)]
    fn value(self) -> f64 {
        self.0.value()
    }

    #[inline(always)]
    fn is_constant(self) -> bool {
        self.0.is_constant()
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
}

/// Partials of lean numbers, as those of the numbers inside.
struct Bare<P>(P);

impl<S: Scalar, P: Partials<Lean<S>>> Partials<S> for Bare<P> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(S, f64)) {
        self.0.spread(&mut |argument, partial| f(argument.0, partial));
    }

    #[inline(always)]
    fn settle(self, f: &mut impl FnMut(S, f64)) {
        self.0.settle(&mut |argument, partial| f(argument.0, partial));
    }
}

impl<S: Scalar> Record for Lean<S> {
    fn shape(&self) -> Vec<usize> {
        Vec::new()
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        out.push(self.value());
    }
}
