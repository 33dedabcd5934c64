//! The exponential distribution.

use rand::Rng;
use rand_distr::Exp1;

use crate::density::DomainError;
use crate::distribution::traits::normaliser;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{Tail, ln_one_minus_exp};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Exponential distribution with rate λ (mean 1/λ).
///
/// ln p(x) = ln λ − λ x, for x ≥ 0 and λ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let waiting = Exponential(0.5);
/// assert_eq!(waiting.mean(), 2.0);
/// assert_eq!(waiting.sf(4.0), (-2.0f64).exp());
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 19.
#[derive(Clone, Copy, Debug)]
pub struct Exponential<L>(pub L);

crate::univariate!([L: Parameter] Exponential<L>);

impl<L: Parameter> Univariate for Exponential<L> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Exponential", "rate", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(Exp1);
        unit / self.0.number()
    }

    fn mean(&self) -> f64 {
        self.0.number().recip()
    }

    fn variance(&self) -> f64 {
        self.0.number().powi(-2)
    }

    fn cdf(&self, x: f64) -> f64 {
        -(-self.0.number() * x.max(0.0)).exp_m1()
    }

    fn sf(&self, x: f64) -> f64 {
        (-self.0.number() * x.max(0.0)).exp()
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        let x = x.max(0.0);
        match tail {
            Tail::Lower => ln_one_minus_exp_of_product(self.0.number(), x),
            Tail::Upper => -self.0.number() * x,
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        -(-p).ln_1p() / self.0.number()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        -q.ln() / self.0.number()
    }
}

/// ln(1 − e^{−λw}), accurate even if λw underflows.
fn ln_one_minus_exp_of_product(rate: f64, width: f64) -> f64 {
    let product = rate * width;
    if product < f64::MIN_POSITIVE { rate.ln() + width.ln() } else { ln_one_minus_exp(product) }
}

impl<R, L> UnivariateDensity<R> for Exponential<L>
where
    R: Scalar,
    L: Parameter + Datum<R>,
{
    const CONSTANT: bool = L::CONSTANT;

    #[inline(always)]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let rate = self.0.number();
        terms.add(
            normaliser(terms, self.0, f64::ln) - rate * x.value(),
            ((x, -rate), (self.0, rate.recip() - x.value())),
        );
    }

    /// Uses ln(e^{−λa} − e^{−λb}) = −λa + ln(1 − e^{−λ(b − a)}).
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let rate = self.0.number();
        let lower = lower.max(0.0);
        let width = upper - lower;
        let product = rate * width;
        let from_width = if width.is_infinite() {
            0.0
        } else if product < f64::MIN_POSITIVE {
            rate.recip()
        } else {
            width / product.exp_m1()
        };
        R::gather(
            ln_one_minus_exp_of_product(rate, width) - rate * lower,
            ((self.0, from_width - lower),),
        )
    }
}
