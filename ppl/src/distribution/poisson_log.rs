//! The Poisson distribution by the logarithm of its rate.

use rand::Rng;

use super::count_mass::ln_mass_by_sum;
use super::{Count, CountMass, Parameter, Poisson, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::ln_gamma;
use crate::terms::Terms;

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

crate::count!([E: Parameter] PoissonLog<E>);

impl<E: Parameter> PoissonLog<E> {
    fn by_rate(&self) -> Poisson<f64> {
        Poisson(self.0.number().exp())
    }
}

impl<E: Parameter> Count for PoissonLog<E> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("PoissonLog", "logarithm of the rate", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.by_rate().sample(rng)
    }

    fn mean(&self) -> f64 {
        self.0.number().exp()
    }

    fn variance(&self) -> f64 {
        self.0.number().exp()
    }

    fn cdf(&self, k: u64) -> f64 {
        self.by_rate().cdf(k)
    }

    fn sf(&self, k: u64) -> f64 {
        self.by_rate().sf(k)
    }
}

impl<R, E> CountMass<R> for PoissonLog<E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        let rate = self.by_rate();
        // e^η may leave the range of numbers where the mass does not
        let value = match rate.0 {
            normal if normal.is_normal() => rate.ln_pmf(k),
            other if k == 0 || other == f64::INFINITY => -other,
            _ => k as f64 * self.0.number() - ln_gamma(k as f64 + 1.0),
        };
        R::fuse(value, [lift(self.0)], [k as f64 - rate.0])
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        if !terms.leave_out_constants() {
            return terms.add_number(self.ln_pmf(k));
        }
        // without ln k!, which is the same at every point
        let (k, eta) = (k as f64, self.0.number());
        let rate = eta.exp();
        terms.add(k * eta - rate, ((self.0, k - rate),));
    }

    const POOLS: bool = true;

    /// n, Σ k and Σ ln k!.
    fn sum_up(data: impl Iterator<Item = u64>, sums: &mut Vec<f64>) {
        <Poisson<f64> as CountMass<R>>::sum_up(data, sums);
    }

    #[inline(always)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Terms<R>) {
        let &[n, sum, factorials] = sums else { return };
        let eta = self.0.number();
        let rate = eta.exp();
        let constant = if terms.leave_out_constants() { 0.0 } else { factorials };
        terms.add(sum * eta - n * rate - constant, ((self.0, sum - n * rate),));
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        let rate = self.by_rate();
        match rate.interval(first, last) {
            Some((value, in_rate)) => R::fuse(value, [lift(self.0)], [in_rate * rate.0]),
            None => ln_mass_by_sum(self, first, last),
        }
    }
}
