//! The half-Cauchy distribution.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::traits::normaliser;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{Tail, ln_1p_square, ln_ratio, logistic, softplus};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Half-Cauchy distribution with scale (and median) σ. The mean of the distribution is infinite.
///
/// ln p(x) = ln(2/π) − ln σ − ln(1 + (x/σ)²), for x ≥ 0 and σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let tau = HalfCauchy(5.0);
/// assert!((tau.quantile(0.5) - 5.0).abs() < 1e-14);
/// assert_eq!(tau.mean(), f64::INFINITY);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 16;
/// Polson & Scott (2012), doi:10.1214/12-BA730.
#[derive(Clone, Copy, Debug)]
pub struct HalfCauchy<S>(pub S);

/// The constant ln(2/π).
const LN_2_OVER_PI: f64 = -0.451_582_705_289_454_9;

crate::univariate!([S: Parameter] HalfCauchy<S>);

impl<S: Parameter> Univariate for HalfCauchy<S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("HalfCauchy", "scale", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        f64::INFINITY
    }

    fn variance(&self) -> f64 {
        f64::INFINITY
    }

    fn cdf(&self, x: f64) -> f64 {
        2.0 * FRAC_1_PI * x.max(0.0).atan2(self.0.number())
    }

    fn sf(&self, x: f64) -> f64 {
        2.0 * FRAC_1_PI * self.0.number().atan2(x.max(0.0))
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        let (scale, x) = (self.0.number(), x.max(0.0));
        // if far/near is large, atan(near/far) equals near/far up to rounding, and near/far itself can underflow
        let (near, far) = if tail == Tail::Lower { (x, scale) } else { (scale, x) };
        let ln_angle = if far / near > 1e9 { ln_ratio(near, far) } else { near.atan2(far).ln() };
        LN_2_OVER_PI + ln_angle
    }

    fn quantile(&self, p: f64) -> f64 {
        if p > 0.5 {
            self.0.number() / (FRAC_PI_2 * (1.0 - p)).tan()
        } else {
            self.0.number() * (FRAC_PI_2 * p).tan()
        }
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        if q > 0.5 { self.quantile(1.0 - q) } else { self.0.number() / (FRAC_PI_2 * q).tan() }
    }
}

/// Returns ln(1 + e^{2t}) and its derivative with respect to t, for t = ln(x/σ). The computation does not overflow.
fn ln_one_plus_square(t: f64) -> (f64, f64) {
    (softplus(2.0 * t), 2.0 * logistic(2.0 * t).0)
}

impl<S: Parameter> HalfCauchy<S> {
    /// Log probability of an interval whose ends are both far below or both far above the scale. For such an
    /// interval, atan(z) with z = x/σ equals z, or π/2 − 1/z, up to rounding.
    #[cold]
    fn ln_mass_far_out<R: Scalar>(&self, lower: f64, upper: f64) -> R
    where
        S: Datum<R>,
    {
        let (scale, lower) = (self.0.number(), lower.max(0.0));
        let (ln_angle, sign) = if upper < scale {
            (ln_ratio(upper - lower, scale), -1.0)
        } else if upper == f64::INFINITY {
            (ln_ratio(scale, lower), 1.0)
        } else {
            (ln_ratio(scale, lower) + ln_ratio(upper - lower, upper), 1.0)
        };
        R::gather(ln_angle + LN_2_OVER_PI, ((self.0, sign / scale),))
    }
}

impl<R, S> UnivariateDensity<R> for HalfCauchy<S>
where
    R: Scalar,
    S: Parameter + Datum<R>,
{
    const CONSTANT: bool = S::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let scale = self.0.number();
        let inverse = scale.recip();
        let (square, slope, share) = ln_1p_square(x.value() * inverse);
        terms.add(
            LN_2_OVER_PI - scale.ln() - square,
            ((x, -2.0 * slope * inverse), (self.0, (2.0 * share - 1.0) * inverse)),
        );
    }

    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let inverse = self.0.number().recip();
        let x = y.value().exp();
        let square = (x * inverse).powi(2);
        // −ln(1 + z²) and 2 z²/(1 + z²); computed from ln z if z² overflows or underflows
        let (minus_ln, share) = if (1e-300..1e300).contains(&square) {
            (terms.minus_ln(1.0 + square), 2.0 * square / (1.0 + square))
        } else {
            let (ln, share) = ln_one_plus_square(y.value() - self.0.number().ln());
            (-ln, share)
        };
        let constant = normaliser(terms, self.0, |scale| scale.ln() - LN_2_OVER_PI);
        terms.add(
            minus_ln + y.value() - constant,
            ((y, 1.0 - share), (self.0, (share - 1.0) * inverse)),
        );
        terms.replace(y, x, x)
    }

    /// Computes ln P = ln[(2/π) atan((b − a) σ/(σ² + a b))]. The derivative of ln P with respect to σ is (a p(a) − b
    /// p(b))/(σ P). P is the probability of the interval (a, b).
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let scale = self.0.number();
        let (a, b) = (lower.max(0.0) / scale, upper / scale);
        if a > 1e9 || b < 1e-9 {
            return self.ln_mass_far_out(lower, upper);
        }
        let angle = if b == f64::INFINITY {
            1f64.atan2(a)
        } else if a > 1.0 {
            // divide by b, because a b can overflow
            (1.0 - a / b).atan2(a + b.recip())
        } else {
            (b - a).atan2(1.0 + a * b)
        };
        let end = |z: f64| ln_1p_square(z).1;
        let in_scale = (end(a) - if b == f64::INFINITY { 0.0 } else { end(b) }) / (angle * scale);
        R::gather(angle.ln() + LN_2_OVER_PI, ((self.0, in_scale),))
    }
}
