//! The Bernoulli distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Bernoulli distribution of a flag that is true with probability p. The distribution is for observed data; it cannot
/// be the prior of an unknown.
///
/// ln P(true) = ln p, ln P(false) = ln(1 − p), for 0 ≤ p ≤ 1.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Bernoulli(0.25).ln_density(&false);
/// assert_eq!(ln_mass, (-0.25f64).ln_1p());
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, ch. 3.
#[derive(Clone, Copy, Debug)]
pub struct Bernoulli<P>(pub P);

impl<P: Parameter> Family for Bernoulli<P> {}

impl<P: Parameter> Bernoulli<P> {
    /// Probability that the flag is true.
    pub fn mean(&self) -> f64 {
        self.0.number()
    }

    /// Returns the log probability of the flag, ln p or ln(1 − p), and its derivative with respect to p. The
    /// derivative is set to 0 for a flag of probability zero, because the product of an infinite derivative and a
    /// weight of zero is NaN.
    #[inline(always)]
    fn ln_mass(&self, flag: bool) -> (f64, f64) {
        let p = self.0.number();
        if !(0.0..=1.0).contains(&p) {
            (f64::NAN, f64::NAN)
        } else if flag {
            (p.ln(), if p == 0.0 { 0.0 } else { p.recip() })
        } else {
            ((-p).ln_1p(), if p == 1.0 { 0.0 } else { -(1.0 - p).recip() })
        }
    }

    /// Variance p (1 − p).
    pub fn variance(&self) -> f64 {
        let p = self.0.number();
        p * (1.0 - p)
    }
}

impl<R, P> Distribution<R> for Bernoulli<P>
where
    R: Scalar,
    P: Parameter + Datum<R>,
{
    type Value = bool;

    #[inline(always)]
    fn add_terms(&self, flag: &bool, terms: &mut impl Accumulator<R>) {
        let (value, derivative) = self.ln_mass(*flag);
        terms.add(value, ((self.0, derivative),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        let p = self.0.number();
        let holds = (0.0..=1.0).contains(&p);
        DomainError::require(holds, "Bernoulli", "probability", "within 0 and 1", p)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> bool {
        rng.random::<f64>() < self.0.number()
    }
}
