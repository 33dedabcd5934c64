//! The Cauchy distribution.

use std::f64::consts::{FRAC_1_PI, PI};

use rand::Rng;

use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::ln_1p_square;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Cauchy distribution with location (and median) μ and scale σ; it has no mean.
///
/// ln p(x) = −ln π − ln σ − ln(1 + ((x − μ)/σ)²), for σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let peak = Cauchy(1.0, 2.0);
/// assert!((peak.cdf(3.0) - 0.75).abs() < 1e-15);
/// assert!(peak.mean().is_nan());
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 16.
#[derive(Clone, Copy, Debug)]
pub struct Cauchy<M, S>(pub M, pub S);

const LN_PI: f64 = 1.144_729_885_849_400_2;

crate::univariate!([M: Parameter, S: Parameter] Cauchy<M, S>);

impl<M: Parameter, S: Parameter> Cauchy<M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

/// The z with P(Z > z) = q.
fn upper(q: f64) -> f64 {
    if (0.25..0.75).contains(&q) { (PI * (0.5 - q)).tan() } else { (PI * q).tan().recip() }
}

/// arctan b − arctan a for a < b, without cancellation.
fn angle(a: f64, b: f64) -> f64 {
    if b == f64::INFINITY {
        1f64.atan2(a)
    } else if a == f64::NEG_INFINITY {
        1f64.atan2(-b)
    } else if a.min(-b).abs() > 1.0 && a * b > 0.0 {
        // both far on one side: in the inverses, whose product cannot overflow
        let (a, b) = (a.recip(), b.recip());
        (a - b).atan2(1.0 + a * b)
    } else {
        (b - a).atan2(1.0 + a * b)
    }
}

impl<M: Parameter, S: Parameter> Univariate for Cauchy<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Cauchy", "location", self.0.number())?;
        DomainError::require_positive("Cauchy", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.upper_quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        f64::NAN
    }

    fn variance(&self) -> f64 {
        f64::NAN
    }

    fn cdf(&self, x: f64) -> f64 {
        FRAC_1_PI * 1f64.atan2(-self.standardise(x))
    }

    fn sf(&self, x: f64) -> f64 {
        FRAC_1_PI * 1f64.atan2(self.standardise(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() - self.1.number() * upper(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() + self.1.number() * upper(q)
    }
}

impl<R, M, S> UnivariateDensity<R> for Cauchy<M, S>
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
        let (square, slope, share) = ln_1p_square(self.standardise(x.value()));
        let in_x = -2.0 * slope * inverse;
        terms.add(
            -LN_PI - scale.ln() - square,
            ((x, in_x), (self.0, -in_x), (self.1, (2.0 * share - 1.0) * inverse)),
        );
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let [a, b] = [lower, upper].map(|x| self.standardise(x));
        let angle = angle(a, b);
        let relative = (angle * self.1.number()).recip();
        let [at_a, at_b] = [a, b].map(|z| {
            if z.is_infinite() {
                return (0.0, 0.0);
            }
            // z/(1 + z²) and 1/(1 + z²), relative to the mass before they underflow
            let moved = ln_1p_square(z).1 * relative;
            (if z.abs() > 1.0 { moved / z } else { relative / (1.0 + z * z) }, moved)
        });
        let outside = FRAC_1_PI * (1f64.atan2(-a) + 1f64.atan2(b));
        let value = if outside < 0.5 { (-outside).ln_1p() } else { angle.ln() - LN_PI };
        R::fuse(value, [lift(self.0), lift(self.1)], [at_a.0 - at_b.0, at_a.1 - at_b.1])
    }
}
