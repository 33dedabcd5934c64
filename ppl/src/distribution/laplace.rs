//! The Laplace distribution.

use std::f64::consts::LN_2;

use rand::Rng;

use super::interval_mass::{LnTails, ln_mass_by_tails};
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Laplace (double exponential) distribution with location μ and scale σ.
///
/// ln p(x) = −|x − μ|/σ − ln 2σ, for σ > 0. Its kink at μ has derivative 0. The normal
/// approximation at a mode is [`ppl::Laplace`](crate::Laplace), which the prelude leaves out.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let slope = Laplace(0.0, 0.5);
/// assert_eq!(slope.variance(), 0.5);
/// assert!((slope.sf(0.5) - 0.5 * (-1.0f64).exp()).abs() < 1e-16);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 24.
#[derive(Clone, Copy, Debug)]
pub struct Laplace<M, S>(pub M, pub S);

crate::univariate!([M: Parameter, S: Parameter] Laplace<M, S>);

impl<M: Parameter, S: Parameter> Laplace<M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

/// P(Z > z).
fn above(z: f64) -> f64 {
    if z > 0.0 { 0.5 * (-z).exp() } else { 1.0 - 0.5 * z.exp() }
}

/// The z with P(Z > z) = q.
fn upper(q: f64) -> f64 {
    if q <= 0.5 { -(2.0 * q).ln() } else { (2.0 * (1.0 - q)).ln() }
}

/// ln P(Z < z).
fn ln_below(z: f64) -> f64 {
    if z < 0.0 { z - LN_2 } else { (-0.5 * (-z).exp()).ln_1p() }
}

impl<M: Parameter, S: Parameter> Univariate for Laplace<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Laplace", "location", self.0.number())?;
        DomainError::require_positive("Laplace", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.upper_quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        self.0.number()
    }

    fn variance(&self) -> f64 {
        2.0 * self.1.number().powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        above(-self.standardise(x))
    }

    fn sf(&self, x: f64) -> f64 {
        above(self.standardise(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() - self.1.number() * upper(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() + self.1.number() * upper(q)
    }
}

impl<R, M, S> UnivariateDensity<R> for Laplace<M, S>
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
        let deviation = x.value() - self.0.number();
        let distance = deviation.abs() * inverse;
        let in_x = if deviation == 0.0 { 0.0 } else { -inverse.copysign(deviation) };
        terms.add(
            -distance - LN_2 - scale.ln(),
            ((x, in_x), (self.0, -in_x), (self.1, (distance - 1.0) * inverse)),
        );
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        ln_mass_by_tails(
            [lift(self.0), lift(self.1)],
            [lower, upper],
            |z| LnTails { below: ln_below(z), above: ln_below(-z) },
            |z| -z.abs() - LN_2,
        )
    }
}
