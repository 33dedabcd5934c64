//! The Poisson distribution by the logarithm of its rate.

use rand::Rng;

use super::poisson::{draw_count, ln_pmf};
use crate::accumulator::{Accumulator, Joined};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::ln_gamma;

/// Poisson distribution of a count with rate e^η, for log-linear regression; it can be observed,
/// not declared.
///
/// ln P(k) = k η − e^η − ln k!, for k = 0, 1, 2, … and real η.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let by_logarithm: f64 = PoissonLog(3f64.ln()).ln_density(&2);
/// let by_rate: f64 = Poisson(3.0).ln_density(&2);
/// assert!((by_logarithm - by_rate).abs() < 1e-14);
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 6.
#[derive(Clone, Copy, Debug)]
pub struct PoissonLog<E>(pub E);

impl<E: Parameter> Family for PoissonLog<E> {}

impl<E: Parameter> PoissonLog<E> {
    /// Expectation e^η.
    pub fn mean(&self) -> f64 {
        self.0.number().exp()
    }

    /// Variance e^η.
    pub fn variance(&self) -> f64 {
        self.mean()
    }
}

impl<R, E> Distribution<R> for PoissonLog<E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    type Value = u64;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        Joined::of(|terms| self.add_terms(k, terms))
    }

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (k, eta) = (*k as f64, self.0.number());
        let rate = eta.exp();
        let value = if terms.leave_out_constants() {
            // without ln k!, which is the same at every point
            k * eta - rate
        } else if rate.is_normal() {
            ln_pmf(k, rate)
        } else if k == 0.0 || rate == f64::INFINITY {
            -rate
        } else {
            // e^η leaves the range of numbers where the mass does not
            k * eta - ln_gamma(k + 1.0)
        };
        terms.add(value, ((self.0, k - rate),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("PoissonLog", "logarithm of the rate", self.0.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        draw_count(self.mean(), rng)
    }
}
