//! The uniform distribution of counts.

use rand::Rng;

use super::{Count, CountMass, CountParameter};
use crate::density::DomainError;
use crate::scalar::Scalar;

/// Uniform distribution on the counts a, a + 1, …, b; it can be observed, not declared.
///
/// ln P(k) = −ln(b − a + 1), for a ≤ k ≤ b.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let die = DiscreteUniform(1u64, 6u64);
/// let ln_mass: f64 = die.ln_density(&4);
/// assert_eq!(ln_mass, -(6f64.ln()));
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, section 6.10.1.
#[derive(Clone, Copy, Debug)]
pub struct DiscreteUniform<A, B>(pub A, pub B);

crate::count!([A: CountParameter, B: CountParameter] DiscreteUniform<A, B>);

impl<A: CountParameter, B: CountParameter> DiscreteUniform<A, B> {
    /// How many of the counts `first..=last` there are.
    fn number(&self, first: u64, last: u64) -> f64 {
        let (first, last) = (first.max(self.0.count()), last.min(self.1.count()));
        // through f64: b − a + 1 may be 2⁶⁴
        if first > last { 0.0 } else { (last - first) as f64 + 1.0 }
    }

    fn total(&self) -> f64 {
        self.number(0, u64::MAX)
    }
}

impl<A: CountParameter, B: CountParameter> Count for DiscreteUniform<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        let (a, b) = (self.0.count(), self.1.count());
        let requirement = format_args!("at most the upper end {b}");
        DomainError::require(a <= b, "DiscreteUniform", "lower end", requirement, a)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let (a, b) = (self.0.count(), self.1.count());
        if a <= b { rng.random_range(a..=b) } else { 0 }
    }

    fn mean(&self) -> f64 {
        0.5 * (self.0.count() as f64 + self.1.count() as f64)
    }

    fn variance(&self) -> f64 {
        let total = self.total();
        (total * total - 1.0) / 12.0
    }

    fn cdf(&self, k: u64) -> f64 {
        self.number(0, k) / self.total()
    }

    fn sf(&self, k: u64) -> f64 {
        k.checked_add(1).map_or(0.0, |next| self.number(next, u64::MAX) / self.total())
    }
}

impl<R, A, B> CountMass<R> for DiscreteUniform<A, B>
where
    R: Scalar,
    A: CountParameter,
    B: CountParameter,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        R::from((self.number(k, k) / self.total()).ln())
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        R::from((self.number(first, last) / self.total()).ln())
    }
}
