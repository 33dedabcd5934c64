//! Bernoulli distribution, parametrised by the logit of the probability.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{logistic, softplus};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Bernoulli distribution of a flag that is true with probability 1/(1 + e⁻ˣ), for logistic regression. The
/// distribution is for observed data; it cannot be the prior of an unknown.
///
/// ln P(true) = −ln(1 + e⁻ˣ), ln P(false) = −ln(1 + eˣ), for real x.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = BernoulliLogit(0.0).ln_density(&true);
/// assert_eq!(ln_mass, -(2f64.ln()));
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 4.
#[derive(Clone, Copy, Debug)]
pub struct BernoulliLogit<X>(pub X);

impl<X: Parameter> Family for BernoulliLogit<X> {}

impl<X: Parameter> BernoulliLogit<X> {
    /// Probability that the flag is true.
    pub fn mean(&self) -> f64 {
        logistic(self.0.number()).0
    }

    /// Variance p (1 − p).
    pub fn variance(&self) -> f64 {
        let (p, q) = logistic(self.0.number());
        p * q
    }
}

impl<R, X> Distribution<R> for BernoulliLogit<X>
where
    R: Scalar,
    X: Parameter + Datum<R>,
{
    type Value = bool;

    #[inline]
    fn ln_density(&self, flag: &bool) -> R {
        let sign = if *flag { 1.0 } else { -1.0 };
        let against = -sign * self.0.number();
        R::gather(-softplus(against), ((self.0, sign * logistic(against).0),))
    }

    /// Computes ln(1 + e) instead of `ln_1p(e)`, so that the accumulator can combine the logarithms of several data
    /// to one logarithm of a product. The error of 10⁻¹⁶ is negligible.
    #[inline(always)]
    fn add_terms(&self, flag: &bool, terms: &mut impl Accumulator<R>) {
        let sign = if *flag { 1.0 } else { -1.0 };
        let against = -sign * self.0.number();
        let (p, e) = (logistic(against).0, (-against.abs()).exp());
        let value = terms.minus_ln(1.0 + e) - against.max(0.0);
        terms.add(value, ((self.0, sign * p),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("BernoulliLogit", "logit", self.0.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> bool {
        rng.random::<f64>() < logistic(self.0.number()).0
    }
}
