//! The geometric distribution.

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Count, CountMass, Parameter, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::{Joined, Terms};

/// Geometric distribution of the failures before the first success, each trial succeeding with
/// probability p; it can be observed, not declared.
///
/// ln P(k) = ln p + k ln(1 − p), for k = 0, 1, 2, … and 0 < p ≤ 1. PyMC's `Geometric` counts the
/// trials, k + 1.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Geometric(0.5).ln_density(&3);
/// assert!((ln_mass - 0.0625f64.ln()).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, section 5.2.
#[derive(Clone, Copy, Debug)]
pub struct Geometric<P>(pub P);

crate::count!([P: Parameter] Geometric<P>);

impl<P: Parameter> Geometric<P> {
    /// −ln P(K ≥ k) and its derivative.
    fn hazard(&self, k: f64) -> (f64, [f64; 1]) {
        let p = self.0.number();
        if k == 0.0 { (0.0, [0.0]) } else { (-k * (-p).ln_1p(), [k / (1.0 - p)]) }
    }
}

impl<P: Parameter> Count for Geometric<P> {
    fn validate(&self) -> Result<(), DomainError> {
        let p = self.0.number();
        let holds = p > 0.0 && p <= 1.0;
        DomainError::require(holds, "Geometric", "probability", "above 0 and at most 1", p)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        // the whole part of an exponential variable; `as` saturates, and NaN is 0
        (unit / -(-self.0.number()).ln_1p()) as u64
    }

    fn mean(&self) -> f64 {
        let p = self.0.number();
        (1.0 - p) / p
    }

    fn variance(&self) -> f64 {
        let p = self.0.number();
        (1.0 - p) / (p * p)
    }

    fn cdf(&self, k: u64) -> f64 {
        -(-self.hazard(k as f64 + 1.0).0).exp_m1()
    }

    fn sf(&self, k: u64) -> f64 {
        (-self.hazard(k as f64 + 1.0).0).exp()
    }
}

impl<R, P> CountMass<R> for Geometric<P>
where
    R: Scalar,
    P: Parameter + Datum<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        Joined::of(|terms| self.add_ln_pmf(k, terms))
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        let p = self.0.number();
        let (hazard, [slope]) = self.hazard(k as f64);
        terms.add(p.ln() - hazard, ((self.0, p.recip() - slope),));
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        let after = if last == u64::MAX { f64::INFINITY } else { last as f64 + 1.0 };
        ln_mass_by_hazard([lift(self.0)], self.hazard(first as f64), self.hazard(after))
    }
}
