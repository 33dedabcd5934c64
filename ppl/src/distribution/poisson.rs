//! The Poisson distribution.

use rand::Rng;

use super::{Distribution, Family, Parameter};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, deviance, regularised_gamma, stirling_error};

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

impl<L: Parameter> Poisson<L> {
    /// Expectation.
    pub fn mean(&self) -> f64 {
        self.0.number()
    }

    /// Variance.
    pub fn variance(&self) -> f64 {
        self.0.number()
    }

    /// P(K ≤ k), accurate in the lower tail.
    pub fn cdf(&self, k: u64) -> f64 {
        regularised_gamma(k as f64 + 1.0, self.0.number()).1
    }

    /// P(K > k), accurate in the upper tail.
    pub fn sf(&self, k: u64) -> f64 {
        regularised_gamma(k as f64 + 1.0, self.0.number()).0
    }
}

impl<R, L> Distribution<R> for Poisson<L>
where
    R: Scalar,
    L: Parameter + Datum<R>,
{
    type Value = u64;
    const SUMMANDS: bool = true;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        let (k, rate) = (*k as f64, self.0.number());
        let value = if rate.is_nan() || rate <= 0.0 {
            f64::NAN
        } else if k == 0.0 {
            -rate
        } else if R::LEAN {
            // without ln k!, which is the same at every point
            k * rate.ln() - rate
        } else {
            -stirling_error(k) - deviance(k, rate) - 0.5 * k.ln() - HALF_LN_2PI
        };
        R::term(value, ((self.0, k / rate - 1.0),))
    }

    /// n and Σ k suffice, where Σ ln k! may be left out.
    #[inline(always)]
    fn ln_densities(&self, data: impl Iterator<Item = u64>) -> R {
        let mut total = R::from(0.0);
        if !R::LEAN {
            for k in data {
                total += self.ln_density(&k);
            }
            return total;
        }
        let (mut n, mut sum) = (0.0, 0.0);
        for k in data {
            n += 1.0;
            sum += k as f64;
        }
        let rate = self.0.number();
        let value = if rate > 0.0 { sum * rate.ln() - n * rate } else { f64::NAN };
        R::term(value, ((self.0, sum / rate - n),))
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Poisson", "rate", self.0.number())
    }

    /// An exact draw; 0 for a rate outside its domain.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        // counts below 2⁵³ are exact as f64, and `as` saturates beyond
        rand_distr::Poisson::new(self.0.number()).map_or(0, |poisson| rng.sample(poisson) as u64)
    }
}
