//! The Bernoulli distribution by the normal quantile of its probability.

use rand::Rng;

use super::{Distribution, Family, Parameter, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{ln_normal_cdf, normal_cdf};

/// Bernoulli distribution of a flag that is true with probability Φ(x), for probit regression; it can
/// be observed, not declared.
///
/// ln P(true) = ln Φ(x), ln P(false) = ln Φ(−x), for real x.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = BernoulliProbit(0.0).ln_density(&true);
/// assert_eq!(ln_mass, -(2f64.ln()));
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 4.
#[derive(Clone, Copy, Debug)]
pub struct BernoulliProbit<X>(pub X);

impl<X: Parameter> Family for BernoulliProbit<X> {}

impl<X: Parameter> BernoulliProbit<X> {
    /// Probability of true.
    pub fn mean(&self) -> f64 {
        normal_cdf(self.0.number())
    }

    /// Variance p (1 − p).
    pub fn variance(&self) -> f64 {
        self.mean() * normal_cdf(-self.0.number())
    }
}

impl<R, X> Distribution<R> for BernoulliProbit<X>
where
    R: Scalar,
    X: Parameter + Datum<R>,
{
    type Value = bool;

    #[inline]
    fn ln_density(&self, flag: &bool) -> R {
        let sign = if *flag { 1.0 } else { -1.0 };
        let (value, slope) = ln_normal_cdf(sign * self.0.number());
        R::fuse(value, [lift(self.0)], [sign * slope])
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("BernoulliProbit", "predictor", self.0.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> bool {
        rng.random::<f64>() < self.mean()
    }
}
