//! Binomial distribution, parametrised by the probability or by its logit.

use rand::Rng;

use super::count_parameter::CountParameter;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{HALF_LN_2PI, deviance, ln_beta, logistic, stirling_error};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Binomial distribution of the number of successes among n trials with success probability p. The distribution is
/// for observed data; it cannot be the prior of an unknown.
///
/// ln P(k) = ln C(n, k) + k ln p + (n − k) ln(1 − p), for k = 0, …, n and 0 ≤ p ≤ 1.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Binomial(3u64, 0.5).ln_density(&1);
/// assert!((ln_mass - 0.375f64.ln()).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, ch. 3; Loader (2000), *Fast
/// and Accurate Computation of Binomial Probabilities*.
#[derive(Clone, Copy, Debug)]
pub struct Binomial<N, P>(pub N, pub P);

/// Binomial distribution, parametrised by the logit x of the success probability 1/(1 + e⁻ˣ), for logistic
/// regression. The distribution is for observed data; it cannot be the prior of an unknown.
///
/// ln P(k) = ln C(n, k) − k ln(1 + e⁻ˣ) − (n − k) ln(1 + eˣ), for k = 0, …, n and real x.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = BinomialLogit(3u64, 0.0).ln_density(&1);
/// assert!((ln_mass - 0.375f64.ln()).abs() < 1e-15);
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 4.
#[derive(Clone, Copy, Debug)]
pub struct BinomialLogit<N, X>(pub N, pub X);

/// Number of trials with the probabilities p of success and q = 1 − p of failure. Both p and q are stored, because 1
/// − p has rounding errors if p is near 1.
#[derive(Clone, Copy)]
struct Trials {
    n: u64,
    p: f64,
    q: f64,
    /// The logarithms ln p and ln q if p or q is below the smallest normal number; otherwise `None`.
    underflow: Option<[f64; 2]>,
}

/// Creates `Trials` from the success probability p.
#[inline(always)]
fn by_probability(n: u64, p: f64) -> Trials {
    Trials { n, p, q: 1.0 - p, underflow: None }
}

/// Creates `Trials` from the logit x of the success probability.
#[inline(always)]
fn by_logit(n: u64, x: f64) -> Trials {
    let (p, q) = logistic(x);
    let underflow = (p.min(q) < f64::MIN_POSITIVE).then(|| [x.min(0.0), (-x).min(0.0)]);
    Trials { n, p, q, underflow }
}

impl Trials {
    /// Log probability ln P(k). The constant ln C(n, k) is omitted if `omits_constant` is true.
    #[inline]
    fn ln_pmf(self, k: u64, omits_constant: bool) -> f64 {
        let Self { n, p, q, underflow } = self;
        if !(p >= 0.0 && q >= 0.0) {
            return f64::NAN;
        }
        if k > n {
            return f64::NEG_INFINITY;
        }
        let (n, success, failure) = (n as f64, k as f64, (n - k) as f64);
        if n == 0.0 {
            0.0
        } else if let Some([ln_p, ln_q]) = underflow {
            success * ln_p
                + failure * ln_q
                + if omits_constant { 0.0 } else { ln_choose(n, success) }
        } else if success == 0.0 {
            n * if p < 0.5 { (-p).ln_1p() } else { q.ln() }
        } else if failure == 0.0 {
            n * if q < 0.5 { (-q).ln_1p() } else { p.ln() }
        } else if omits_constant {
            success * p.ln() + failure * q.ln()
        } else {
            let stirling = stirling_error(n) - stirling_error(success) - stirling_error(failure);
            let spread = 0.5 * (n / (success * failure)).ln() - HALF_LN_2PI;
            stirling + spread - deviance(success, n * p) - deviance(failure, n * q)
        }
    }

    fn draw<G: Rng + ?Sized>(self, rng: &mut G) -> u64 {
        rand_distr::Binomial::new(self.n, self.p).map_or(0, |binomial| rng.sample(binomial))
    }
}

/// Log binomial coefficient, ln C(n, k) = −ln(n + 1) − ln B(k + 1, n − k + 1).
#[cold]
fn ln_choose(n: f64, k: f64) -> f64 {
    if k == 0.0 || k == n { 0.0 } else { -(n + 1.0).ln() - ln_beta(k + 1.0, n - k + 1.0) }
}

/// Implements the methods that both parametrisations have in common.
macro_rules! impl_moments {
    ($Name:ident, $by_parameter:ident) => {
        impl<N: CountParameter, X: Parameter> Family for $Name<N, X> {}

        impl<N: CountParameter, X: Parameter> $Name<N, X> {
            #[inline(always)]
            fn trials(&self) -> Trials {
                $by_parameter(self.0.count(), self.1.number())
            }

            /// Expectation n p.
            pub fn mean(&self) -> f64 {
                self.trials().n as f64 * self.trials().p
            }

            /// Variance n p (1 − p).
            pub fn variance(&self) -> f64 {
                self.mean() * self.trials().q
            }
        }
    };
}
impl_moments!(Binomial, by_probability);
impl_moments!(BinomialLogit, by_logit);

impl<R: Scalar, N: CountParameter, P: Parameter + Datum<R>> Distribution<R> for Binomial<N, P> {
    type Value = u64;

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let trials = self.trials();
        let (success, failure) = (*k as f64, trials.n as f64 - *k as f64);
        // avoid 0/0 for k = 0 and k = n, and infinite partial derivatives for counts of probability zero: an infinite
        // derivative times a weight of zero is NaN
        let gain = if success == 0.0 || trials.p == 0.0 { 0.0 } else { success / trials.p };
        let loss = if failure <= 0.0 || trials.q == 0.0 { 0.0 } else { failure / trials.q };
        let value = trials.ln_pmf(*k, terms.leave_out_constants());
        terms.add(value, ((self.1, gain - loss),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        let p = self.1.number();
        let holds = (0.0..=1.0).contains(&p);
        DomainError::require(holds, "Binomial", "probability", "within 0 and 1", p)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.trials().draw(rng)
    }
}

impl<R: Scalar, N: CountParameter, X: Parameter + Datum<R>> Distribution<R>
    for BinomialLogit<N, X>
{
    type Value = u64;

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let trials = self.trials();
        let (success, failure) = (*k as f64, trials.n as f64 - *k as f64);
        let value = trials.ln_pmf(*k, terms.leave_out_constants());
        // k − n p, written without cancellation in the tails
        terms.add(value, ((self.1, success * trials.q - failure * trials.p),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("BinomialLogit", "logit", self.1.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.trials().draw(rng)
    }
}
