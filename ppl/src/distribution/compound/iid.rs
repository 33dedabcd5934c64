//! Vectors of independent values whose length is known at run time.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::{Family, Iid};
use crate::distribution::traits::{Distribution, Unknown};
use crate::number::scalar::Scalar;
use crate::term::accumulator::Accumulator;

impl<D: Family> Family for Iid<D> {}

impl<R: Scalar, D: Distribution<R>> Distribution<R> for Iid<D> {
    type Value = Vec<D::Value>;

    #[inline(always)]
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>) {
        if x.len() != self.n {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        for x in x {
            self.inner.add_terms(x, terms);
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
        let mut values = Vec::with_capacity(self.n);
        for _ in 0..self.n {
            values.push(self.inner.draw(rng));
        }
        values
    }
}

impl<R: Scalar, D: Unknown<R>> Unknown<R> for Iid<D> {
    fn dim(&self) -> usize {
        self.n * self.inner.dim()
    }

    #[inline(always)]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Self::Value {
        self.inner.constrain_all(self.n, next, jacobian, terms)
    }

    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
        for x in x {
            self.inner.unconstrain(x, out);
        }
    }

    fn bounds(&self) -> Option<(f64, f64)> {
        self.inner.bounds()
    }
}
