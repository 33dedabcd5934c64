//! The Poisson distribution.

use rand::Rng;

use super::count_mass::{ln_inside, ln_mass_by_sum};
use super::{Count, CountMass, Parameter, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, deviance, ln_gamma, regularised_gamma, stirling_error};
use crate::terms::{Joined, Terms};

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

crate::count!([L: Parameter] Poisson<L>);

/// ln P(k) of a positive rate.
#[inline]
fn ln_pmf(k: f64, rate: f64) -> f64 {
    if rate.is_nan() || rate <= 0.0 {
        f64::NAN
    } else if k == 0.0 {
        -rate
    } else {
        -stirling_error(k) - deviance(k, rate) - 0.5 * k.ln() - HALF_LN_2PI
    }
}

impl<L: Parameter> Poisson<L> {
    /// ln P(first ≤ K ≤ last) and its derivative in the rate, (p(first − 1) − p(last))/P; unless
    /// it underflows.
    pub(super) fn interval(&self, first: u64, last: u64) -> Option<(f64, f64)> {
        let value = ln_inside(self, first, last)?;
        let at = |k: u64| (ln_pmf(k as f64, self.0.number()) - value).exp();
        let lower = first.checked_sub(1).map_or(0.0, at);
        Some((value, lower - if last == u64::MAX { 0.0 } else { at(last) }))
    }
}

impl<L: Parameter> Count for Poisson<L> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Poisson", "rate", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        // counts below 2⁵³ are exact as f64, and `as` saturates beyond
        rand_distr::Poisson::new(self.0.number()).map_or(0, |poisson| rng.sample(poisson) as u64)
    }

    fn mean(&self) -> f64 {
        self.0.number()
    }

    fn variance(&self) -> f64 {
        self.0.number()
    }

    fn cdf(&self, k: u64) -> f64 {
        regularised_gamma(k as f64 + 1.0, self.0.number()).1
    }

    fn sf(&self, k: u64) -> f64 {
        regularised_gamma(k as f64 + 1.0, self.0.number()).0
    }
}

impl<R, L> CountMass<R> for Poisson<L>
where
    R: Scalar,
    L: Parameter + Datum<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        Joined::of(|terms| self.add_ln_pmf(k, terms))
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        let (k, rate) = (k as f64, self.0.number());
        let value = if terms.leave_out_constants() && k > 0.0 {
            // without ln k!, which is the same at every point
            k * rate.ln() - rate
        } else {
            ln_pmf(k, rate)
        };
        terms.add(value, ((self.0, k / rate - 1.0),));
    }

    const POOLS: bool = true;

    /// n, Σ k and Σ ln k!.
    fn sum_up(data: impl Iterator<Item = u64>, sums: &mut Vec<f64>) {
        let (mut n, mut sum, mut factorials) = (0.0, 0.0, 0.0);
        for k in data {
            n += 1.0;
            sum += k as f64;
            factorials += ln_gamma(k as f64 + 1.0);
        }
        sums.extend([n, sum, factorials]);
    }

    #[inline(always)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Terms<R>) {
        let &[n, sum, factorials] = sums else { return };
        let rate = self.0.number();
        let constant = if terms.leave_out_constants() { 0.0 } else { factorials };
        let value = if rate > 0.0 { sum * rate.ln() - n * rate - constant } else { f64::NAN };
        terms.add(value, ((self.0, sum / rate - n),));
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        match self.interval(first, last) {
            Some((value, in_rate)) => R::fuse(value, [lift(self.0)], [in_rate]),
            None => ln_mass_by_sum(self, first, last),
        }
    }
}
