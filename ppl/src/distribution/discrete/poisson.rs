//! The Poisson distribution.

use rand::Rng;

use crate::accumulator::{Accumulator, Joined};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, deviance, stirling_error};

/// Poisson distribution of a count with rate λ; it can be observed, not declared.
///
/// ln P(k) = k ln λ − λ − ln k!, for k = 0, 1, 2, … and λ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Poisson(3.0).ln_density(&2);
/// assert!((ln_mass - (4.5f64.ln() - 3.0)).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, ch. 4.
#[derive(Clone, Copy, Debug)]
pub struct Poisson<L>(pub L);

impl<L: Parameter> Family for Poisson<L> {}

/// ln P(k) of a positive rate.
#[inline]
pub(super) fn ln_pmf(k: f64, rate: f64) -> f64 {
    if rate.is_nan() || rate <= 0.0 {
        f64::NAN
    } else if k == 0.0 {
        -rate
    } else {
        -stirling_error(k) - deviance(k, rate) - 0.5 * k.ln() - HALF_LN_2PI
    }
}

impl<L: Parameter> Poisson<L> {
    /// Expectation λ.
    pub fn mean(&self) -> f64 {
        self.0.number()
    }

    /// Variance λ.
    pub fn variance(&self) -> f64 {
        self.0.number()
    }
}

/// A draw at a rate that may be too large for counts, or none: 0 then.
pub(super) fn draw_count<G: Rng + ?Sized>(rate: f64, rng: &mut G) -> u64 {
    // counts below 2⁵³ are exact as f64, and `as` saturates beyond
    rand_distr::Poisson::new(rate).map_or(0, |poisson| rng.sample(poisson) as u64)
}

impl<R, L> Distribution<R> for Poisson<L>
where
    R: Scalar,
    L: Parameter + Datum<R>,
{
    type Value = u64;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        Joined::of(|terms| self.add_terms(k, terms))
    }

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (k, rate) = (*k as f64, self.0.number());
        let value = if terms.leave_out_constants() && k > 0.0 {
            // without ln k!, which is the same at every point
            k * rate.ln() - rate
        } else {
            ln_pmf(k, rate)
        };
        terms.add(value, ((self.0, k / rate - 1.0),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Poisson", "rate", self.0.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        draw_count(self.0.number(), rng)
    }
}
