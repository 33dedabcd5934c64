//! Ordered values: independent values, sorted in ascending order.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::{Family, Ordered};
use crate::distribution::traits::{Distribution, Unknown};
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::{UnivariateDensity, add_terms};
use crate::distribution::vector::Repeated;
use crate::number::scalar::Scalar;
use crate::special::ln_gamma;
use crate::term::accumulator::Accumulator;
use crate::transform::Ascending;

impl<A: Family> Family for Ordered<A> {}

impl<A> Ordered<A> {
    /// Adds the log density of the sorted values, Σ ln p₀(xᵢ) + ln N!.
    fn add_all<R: Scalar, T: Accumulator<R>>(
        &self,
        x: &[R],
        terms: &mut T,
        add_ln_pdf: impl Fn(R, &mut T),
    ) {
        x.iter().for_each(|&x| add_ln_pdf(x, terms));
        terms.add_number(R::from(ln_gamma(x.len() as f64 + 1.0)));
    }
}

impl<R, A> Distribution<R> for Ordered<A>
where
    R: Scalar,
    A: Repeated<R, Element: UnivariateDensity<R>>,
{
    type Value = A::Values;

    fn add_terms(&self, x: &A::Values, terms: &mut impl Accumulator<R>) {
        let x = x.as_ref();
        if x.len() != self.inner.size() || x.windows(2).any(|pair| pair[0] > pair[1]) {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        self.add_all(x, terms, |x, terms| add_terms(self.inner.element(), x, terms));
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.inner.element().validate()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> A::Values {
        let mut values = self.inner.zeros();
        let x = values.as_mut();
        let element = self.inner.element();
        let support = element.support();
        x.iter_mut().for_each(|x| *x = R::from(support.inside(element.sample(rng))));
        x.sort_by(|a, b| a.value().total_cmp(&b.value()));
        values
    }
}

impl<R, A> Unknown<R> for Ordered<A>
where
    R: Scalar,
    A: Repeated<R, Element: UnivariateDensity<R>>,
{
    fn dim(&self) -> usize {
        self.inner.size()
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> A::Values {
        let element = self.inner.element();
        let mut values = self.inner.zeros();
        let log_jacobian = Ascending(element.support()).constrain(next, values.as_mut());
        self.add_all(values.as_ref(), terms, |x, terms| element.add_ln_pdf(x, terms));
        if jacobian {
            terms.add_number(log_jacobian);
        }
        values
    }

    fn unconstrain(&self, x: &A::Values, out: &mut Vec<f64>) {
        Ascending(self.inner.element().support()).unconstrain(x.as_ref(), out);
    }

    fn bounds(&self) -> Option<(f64, f64)> {
        self.inner.element().chosen_ends()
    }
}
