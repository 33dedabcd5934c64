//! Poisson distribution, parametrised by the rate or by the logarithm of the rate.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{HALF_LN_2PI, deviance, ln_gamma, stirling_error};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Poisson distribution of a count with rate λ. The distribution is for observed data; it cannot be the prior of an
/// unknown.
///
/// ln P(k) = k ln λ − λ − ln k!, for k = 0, 1, 2, … and λ ≥ 0. With λ = 0 every count is zero, so that
/// `Mixture([absent, 1.0 - absent], [Poisson(0.0 * rate), Poisson(rate)])` is a zero-inflated Poisson distribution.
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

/// Poisson distribution of a count with rate e^η, for log-linear regression. The distribution is for observed data;
/// it cannot be the prior of an unknown.
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

impl<L: Parameter> Family for Poisson<L> {}
impl<E: Parameter> Family for PoissonLog<E> {}

/// Returns the log probability ln P(k), given the rate and its logarithm; NaN for a negative rate. The constant ln k! is
/// omitted if `omits_constant` is true.
#[inline]
fn ln_pmf(k: f64, rate: f64, ln_rate: impl Fn() -> f64, omits_constant: bool) -> f64 {
    if rate.is_nan() || rate < 0.0 {
        f64::NAN
    } else if k == 0.0 || rate == f64::INFINITY {
        -rate
    } else if omits_constant {
        k * ln_rate() - rate
    } else if rate.is_normal() {
        -stirling_error(k) - deviance(k, rate) - 0.5 * k.ln() - HALF_LN_2PI
    } else {
        // e^η can overflow or underflow although the log probability is finite
        k * ln_rate() - ln_gamma(k + 1.0)
    }
}

/// Draws a count; 0 if the rate is 0 or too large for `u64`.
pub(super) fn draw_count<G: Rng + ?Sized>(rate: f64, rng: &mut G) -> u64 {
    // f64 represents counts below 2⁵³ exactly, and `as` saturates for counts that are too large for `u64`
    rand_distr::Poisson::new(rate).map_or(0, |poisson| rng.sample(poisson) as u64)
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

impl<R: Scalar, L: Parameter + Datum<R>> Distribution<R> for Poisson<L> {
    type Value = u64;

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (k, rate) = (*k as f64, self.0.number());
        let value = ln_pmf(k, rate, || rate.ln(), terms.leave_out_constants());
        // at rate 0, a positive count has probability 0 and an infinite derivative; the product of this derivative and
        // a weight of zero would be NaN
        let in_rate = if k == 0.0 || rate == 0.0 { -1.0 } else { k / rate - 1.0 };
        terms.add(value, ((self.0, in_rate),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        let rate = self.0.number();
        let holds = rate >= 0.0 && rate.is_finite();
        DomainError::require(holds, "Poisson", "rate", "at least 0 and finite", rate)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        draw_count(self.0.number(), rng)
    }
}

impl<R: Scalar, E: Parameter + Datum<R>> Distribution<R> for PoissonLog<E> {
    type Value = u64;

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (k, eta) = (*k as f64, self.0.number());
        let rate = eta.exp();
        let value = ln_pmf(k, rate, || eta, terms.leave_out_constants());
        terms.add(value, ((self.0, k - rate),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("PoissonLog", "logarithm of the rate", self.0.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        draw_count(self.mean(), rng)
    }
}
