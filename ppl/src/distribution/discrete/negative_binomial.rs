//! The negative binomial distribution.

use rand::Rng;

use super::binomial::ln_binomial;
use super::poisson::draw_count;
use crate::accumulator::{Accumulator, Joined};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::continuous::Gamma;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, lift};
use crate::distribution::univariate::Univariate;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::{digamma_rise, ln_1p_minus};

/// Negative binomial distribution of a count with mean μ and dispersion φ: a Poisson count whose
/// rate is Gamma(φ, φ/μ). It can be observed, not declared.
///
/// ln P(k) = ln Γ(k + φ) − ln Γ(φ) − ln k! + φ ln(φ/(μ + φ)) + k ln(μ/(μ + φ)), for k = 0, 1, 2, …
/// and μ, φ > 0. The variance is μ + μ²/φ. These arguments are those of Stan's `neg_binomial_2`
/// and PyMC's `NegativeBinomial(mu, alpha)`; [`with_rate`](NegativeBinomial::with_rate) and
/// [`with_probability`](NegativeBinomial::with_probability) take the other usual ones.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // one success: the geometric distribution
/// let ln_mass: f64 = NegativeBinomial::with_probability(1.0, 0.25).ln_density(&3);
/// assert!((ln_mass - (0.25 * 0.75f64.powi(3)).ln()).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, ch. 5.
#[derive(Clone, Copy, Debug)]
pub struct NegativeBinomial<M, F>(pub M, pub F);

impl<M: Parameter, F: Parameter> Family for NegativeBinomial<M, F> {}

impl<S: Scalar> NegativeBinomial<S, S> {
    /// A Poisson count whose rate is Gamma(α, β): Stan's `neg_binomial`.
    pub fn with_rate(alpha: S, beta: S) -> Self {
        Self(alpha / beta, alpha)
    }

    /// The failures before the r-th success, each trial succeeding with probability p.
    pub fn with_probability(r: S, p: S) -> Self {
        Self(r * (S::from(1.0) - p) / p, r)
    }
}

impl<M: Parameter, F: Parameter> NegativeBinomial<M, F> {
    /// Expectation μ.
    pub fn mean(&self) -> f64 {
        self.0.number()
    }

    /// Variance μ + μ²/φ.
    pub fn variance(&self) -> f64 {
        let mean = self.0.number();
        mean + mean * mean / self.1.number()
    }

    /// ln P(k), and its derivative in φ if that is asked for; μ, φ > 0.
    fn ln_pmf(&self, k: f64, in_dispersion: bool) -> (f64, f64) {
        let (mean, dispersion) = (self.0.number(), self.1.number());
        let inverse = (mean + dispersion).recip();
        let ln_ratio = (mean / dispersion).ln_1p();
        let excess = (k - mean) * inverse;
        let value = if k == 0.0 {
            -dispersion * ln_ratio
        } else {
            // φ successes among k + φ trials, the last of them a success
            let n = k + dispersion;
            let binomial = ln_binomial(dispersion, n, dispersion * inverse, mean * inverse);
            binomial - (k / dispersion).ln_1p()
        };
        let slope = match in_dispersion {
            false => 0.0,
            true if k == 0.0 && excess > -0.5 => ln_1p_minus(excess),
            true => digamma_rise(dispersion, k) - ln_ratio - excess,
        };
        (value, slope)
    }
}

impl<R, M, F> Distribution<R> for NegativeBinomial<M, F>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    F: Parameter + Datum<R>,
{
    type Value = u64;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        Joined::of(|terms| self.add_terms(k, terms))
    }

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (mean, dispersion, count) = (self.0.number(), self.1.number(), *k as f64);
        if !(mean > 0.0 && dispersion > 0.0) {
            return terms.add_number(R::from(f64::NAN));
        }
        let in_dispersion = !lift::<R>(self.1).is_constant();
        let (value, in_dispersion) = self.ln_pmf(count, in_dispersion);
        let in_mean = (count - mean) / (mean + dispersion) * dispersion / mean;
        terms.add(value, ((self.0, in_mean), (self.1, in_dispersion)));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("NegativeBinomial", "mean", self.0.number())?;
        DomainError::require_positive("NegativeBinomial", "dispersion", self.1.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let (mean, dispersion) = (self.0.number(), self.1.number());
        draw_count(Gamma(dispersion, dispersion / mean).sample(rng), rng)
    }
}
