//! The skew-normal distribution.

use std::f64::consts::{LN_2, PI};

use rand::Rng;
use rand_distr::StandardNormal;

use super::{Parameter, Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, Tail, integral_from_zero, ln_normal_cdf, tail_quantile};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Skew-normal distribution with location ξ, scale ω and shape α.
///
/// ln p(x) = ln 2 − ½ z² − ½ ln 2π − ln ω + ln Φ(α z) with z = (x − ξ)/ω, for ω > 0. α = 0 is the
/// normal distribution. Distribution functions are computed by quadrature.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let symmetric: f64 = SkewNormal(1.0, 2.0, 0.0).ln_density(&0.3);
/// let normal: f64 = Normal(1.0, 2.0).ln_density(&0.3);
/// assert!((symmetric - normal).abs() < 1e-15);
/// ```
///
/// # References
/// Azzalini (1985), *Scandinavian Journal of Statistics* 12, 171–178.
#[derive(Clone, Copy, Debug)]
pub struct SkewNormal<X, W, A>(pub X, pub W, pub A);

crate::univariate!([X: Parameter, W: Parameter, A: Parameter] SkewNormal<X, W, A>);

impl<X: Parameter, W: Parameter, A: Parameter> SkewNormal<X, W, A> {
    /// δ = α/√(1 + α²).
    fn delta(&self) -> f64 {
        let shape = self.2.number();
        shape / shape.hypot(1.0)
    }

    /// P(X ≤ x) and P(X > x), from the integral over the side of the location where x lies.
    fn tails(&self, x: f64) -> (f64, f64) {
        let z = (x - self.0.number()) / self.1.number();
        if z.is_infinite() {
            return if z < 0.0 { (0.0, 1.0) } else { (1.0, 0.0) };
        }
        let away = if z < 0.0 { -1.0 } else { 1.0 };
        let density = |d: f64| standard(z + away * d, self.2.number()).0.exp();
        let outside = integral_from_zero(density, f64::INFINITY, (1.0 + z.abs()).recip());
        if z < 0.0 { (outside, 1.0 - outside) } else { (1.0 - outside, outside) }
    }

    fn invert(&self, p: f64, tail: Tail) -> f64 {
        let (location, scale) = (self.0.number(), self.1.number());
        let z = tail_quantile(0.0, p, tail, |z| {
            let (below, above) = self.tails(location + scale * z);
            (below, above, standard(z, self.2.number()).0.exp())
        });
        location + scale * z
    }
}

/// ln p at z for ξ = 0 and ω = 1, and the derivative φ/Φ of ln Φ(α z).
#[inline]
fn standard(z: f64, shape: f64) -> (f64, f64) {
    let (ln_cdf, hazard) = ln_normal_cdf(shape * z);
    (LN_2 - HALF_LN_2PI - 0.5 * z * z + ln_cdf, hazard)
}

impl<X: Parameter, W: Parameter, A: Parameter> Univariate for SkewNormal<X, W, A> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("SkewNormal", "location", self.0.number())?;
        DomainError::require_positive("SkewNormal", "scale", self.1.number())?;
        DomainError::require_finite("SkewNormal", "shape", self.2.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let (first, second): (f64, f64) = (rng.sample(StandardNormal), rng.sample(StandardNormal));
        let shape = self.2.number();
        let z = (shape * first.abs() + second) / shape.hypot(1.0);
        self.0.number() + self.1.number() * z
    }

    fn mean(&self) -> f64 {
        self.0.number() + self.1.number() * self.delta() * (2.0 / PI).sqrt()
    }

    fn variance(&self) -> f64 {
        self.1.number().powi(2) * (1.0 - 2.0 / PI * self.delta().powi(2))
    }

    fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    fn sf(&self, x: f64) -> f64 {
        self.tails(x).1
    }

    fn quantile(&self, p: f64) -> f64 {
        self.invert(p, Tail::Lower)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.invert(q, Tail::Upper)
    }
}

impl<R, X, W, A> UnivariateDensity<R> for SkewNormal<X, W, A>
where
    R: Scalar,
    X: Parameter + Datum<R>,
    W: Parameter + Datum<R>,
    A: Parameter + Datum<R>,
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
        let (scale, shape) = (self.1.number(), self.2.number());
        let inverse = scale.recip();
        let z = (x.value() - self.0.number()) * inverse;
        let (value, hazard) = standard(z, shape);
        let slope = (shape * hazard - z) * inverse;
        terms.add(
            value - scale.ln(),
            ((x, slope), (self.0, -slope), (self.1, -z * slope - inverse), (self.2, z * hazard)),
        );
    }
}
