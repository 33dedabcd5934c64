//! Arrays of independent values whose length is known at compile time.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::{Array, Family};
use crate::distribution::traits::{Distribution, Unknown};
use crate::number::scalar::Scalar;
use crate::term::accumulator::Accumulator;

impl<D: Family, const N: usize> Family for Array<D, N> {}

impl<R: Scalar, D: Distribution<R>, const N: usize> Distribution<R> for Array<D, N> {
    type Value = [D::Value; N];

    #[inline(always)]
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>) {
        for x in x {
            self.inner.add_terms(x, terms);
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
        std::array::from_fn(|_| self.inner.draw(rng))
    }
}

impl<R: Scalar, D: Unknown<R>, const N: usize> Unknown<R> for Array<D, N> {
    fn dim(&self) -> usize {
        N * self.inner.dim()
    }

    #[inline(always)]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Self::Value {
        // a loop is inlined; `array::from_fn` is a function call, and the compiler could then not keep the terms in
        // registers
        let mut values = [const { None }; N];
        for value in &mut values {
            *value = Some(self.inner.constrain(next, jacobian, terms));
        }
        values.map(|value| value.expect("all entries are set"))
    }

    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
        x.iter().for_each(|x| self.inner.unconstrain(x, out));
    }

    fn bounds(&self) -> Option<(f64, f64)> {
        self.inner.bounds()
    }
}
