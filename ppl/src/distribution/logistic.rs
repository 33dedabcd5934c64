//! The logistic distribution.

use std::f64::consts::PI;

use rand::Rng;

use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic, softplus};
use crate::special::ln_one_minus_exp;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Logistic distribution with location μ and scale σ.
///
/// ln p(x) = −z − ln σ − 2 ln(1 + e⁻ᶻ) with z = (x − μ)/σ, for σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // a uniform probability has a standard logistic logit
/// let logit = Logistic(0.0, 1.0);
/// assert!((logit.cdf(2f64.ln()) - 2.0 / 3.0).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 23.
#[derive(Clone, Copy, Debug)]
pub struct Logistic<M, S>(pub M, pub S);

crate::univariate!([M: Parameter, S: Parameter] Logistic<M, S>);

impl<M: Parameter, S: Parameter> Logistic<M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

/// ln p of the standard logistic distribution and its negative derivative tanh(z/2).
#[inline]
pub(super) fn standard(z: f64) -> (f64, f64) {
    let small = (-z.abs()).exp();
    let slope = (1.0 - small) / (1.0 + small);
    (-z.abs() - 2.0 * small.ln_1p(), slope.copysign(z))
}

/// ln P(a < Z < b) of the standard logistic distribution and its derivatives in a and b, from
/// σ(b) − σ(a) = σ(b) σ(−a) (1 − e^{−(b − a)}).
pub(super) fn ln_between(a: f64, b: f64) -> (f64, [f64; 2]) {
    let width = b - a;
    let from_width = width.exp_m1().recip();
    let value = ln_one_minus_exp(width) - softplus(-b) - softplus(a);
    (value, [-logistic(a).0 - from_width, logistic(-b).0 + from_width])
}

impl<M: Parameter, S: Parameter> Univariate for Logistic<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Logistic", "location", self.0.number())?;
        DomainError::require_positive("Logistic", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        self.0.number()
    }

    fn variance(&self) -> f64 {
        (PI * self.1.number()).powi(2) / 3.0
    }

    fn cdf(&self, x: f64) -> f64 {
        logistic(self.standardise(x)).0
    }

    fn sf(&self, x: f64) -> f64 {
        logistic(self.standardise(x)).1
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() + self.1.number() * (p / (1.0 - p)).ln()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() - self.1.number() * (q / (1.0 - q)).ln()
    }
}

impl<R, M, S> UnivariateDensity<R> for Logistic<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let scale = self.1.number();
        let inverse = scale.recip();
        let z = (x.value() - self.0.number()) * inverse;
        let (value, slope) = standard(z);
        terms.add(
            value - scale.ln(),
            (
                (x, -slope * inverse),
                (self.0, slope * inverse),
                (self.1, (z * slope - 1.0) * inverse),
            ),
        );
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let ends = [self.standardise(lower), self.standardise(upper)];
        let (value, [in_a, in_b]) = ln_between(ends[0], ends[1]);
        let moved = |z: f64, slope: f64| if z.is_finite() { z * slope } else { 0.0 };
        let inverse = self.1.number().recip();
        R::fuse(
            value,
            [lift(self.0), lift(self.1)],
            [-(in_a + in_b) * inverse, -(moved(ends[0], in_a) + moved(ends[1], in_b)) * inverse],
        )
    }
}
