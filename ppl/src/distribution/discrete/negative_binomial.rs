//! Negative binomial distribution.

use rand::Rng;

use super::poisson::draw_count;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{HALF_LN_2PI, deviance, ln_1p_minus, ln_minus_digamma, stirling_error};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Negative binomial distribution of a count with mean μ and shape r: a Poisson count whose rate has the distribution
/// `Gamma(r, r/μ)`. The variance is μ + μ²/r. The distribution is for observed data; it cannot be the prior of an
/// unknown.
///
/// ln P(k) = ln Γ(k + r) − ln k! − ln Γ(r) + r ln(r/(r + μ)) + k ln(μ/(r + μ)), for k = 0, 1, 2, … and μ, r > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // one success with probability 1/4: μ = 3, r = 1
/// let failures: f64 = NegativeBinomial(3.0, 1.0).ln_density(&2);
/// assert!((failures - (0.25f64 * 0.75 * 0.75).ln()).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, ch. 5; Loader (2000), *Fast and Accurate
/// Computation of Binomial Probabilities*, for the computation without cancellation.
#[derive(Clone, Copy, Debug)]
pub struct NegativeBinomial<M, N>(pub M, pub N);

impl<M: Parameter, N: Parameter> Family for NegativeBinomial<M, N> {}

impl<M: Parameter, N: Parameter> NegativeBinomial<M, N> {
    /// Expectation μ.
    pub fn mean(&self) -> f64 {
        self.0.number()
    }

    /// Variance μ + μ²/r.
    pub fn variance(&self) -> f64 {
        let mean = self.0.number();
        mean + mean * (mean / self.1.number())
    }
}

/// Log probability of the count k: r/(r + k) times the binomial probability of r successes in r + k trials.
fn ln_pmf(k: f64, mean: f64, shape: f64) -> f64 {
    if !(mean > 0.0 && shape > 0.0) {
        return f64::NAN;
    }
    if k == 0.0 {
        return -shape * (mean / shape).ln_1p();
    }
    let trials = shape + k;
    let success = shape / (shape + mean);
    let failure = mean / (shape + mean);
    let errors = stirling_error(trials) - stirling_error(shape) - stirling_error(k);
    let deviances = deviance(shape, trials * success) + deviance(k, trials * failure);
    errors - deviances - 0.5 * (k.ln() + (trials / shape).ln()) - HALF_LN_2PI
}

impl<R, M, N> Distribution<R> for NegativeBinomial<M, N>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    N: Parameter + Datum<R>,
{
    type Value = u64;

    #[inline]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (k, mean, shape) = (*k as f64, self.0.number(), self.1.number());
        let excess = (k - mean) / (shape + mean);
        let in_mean = excess * (shape / mean);
        // ψ(k + r) − ψ(r) − ln(1 + μ/r) + (μ − k)/(r + μ); to avoid cancellation, the digamma function ψ is expressed
        // by the function ln x − ψ(x)
        let in_shape = ln_1p_minus(excess) + ln_minus_digamma(shape) - ln_minus_digamma(shape + k);
        terms.add(ln_pmf(k, mean, shape), ((self.0, in_mean), (self.1, in_shape)));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("NegativeBinomial", "mean", self.0.number())?;
        DomainError::require_positive("NegativeBinomial", "shape", self.1.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let (mean, shape) = (self.0.number(), self.1.number());
        let rate = rand_distr::Gamma::new(shape, mean / shape);
        draw_count(rate.map_or(f64::NAN, |gamma| rng.sample(gamma)), rng)
    }
}
