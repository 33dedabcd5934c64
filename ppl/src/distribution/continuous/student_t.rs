//! Student's t distribution.

use std::f64::consts::LN_2;

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::interval_mass::CANCELLED;
use crate::distribution::traits::{lift, normaliser};
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{
    HALF_LN_2PI, LnProbability, LnTails, Share, Tail, beta_logit_quantile, ln_1p_minus,
    ln_1p_square, ln_beta_tails, ln_minus_digamma, ln_ratio, memoised, regularised_beta,
    stirling_error,
};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Student's t distribution with ν degrees of freedom, location μ and scale σ.
///
/// ln p(x) = ln Γ((ν + 1)/2) − ln Γ(ν/2) − ½ ln νπ − ln σ − ½ (ν + 1) ln(1 + z²/ν) with
/// z = (x − μ)/σ, for ν, σ > 0. The mean exists for ν > 1, the variance σ² ν/(ν − 2) for ν > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let robust = StudentT(4.0, 1.0, 2.0);
/// assert_eq!(robust.variance(), 8.0);
/// assert!((robust.cdf(1.0) - 0.5).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 28.
#[derive(Clone, Copy, Debug)]
pub struct StudentT<N, M, S>(pub N, pub M, pub S);

crate::univariate!([N: Parameter, M: Parameter, S: Parameter] StudentT<N, M, S>);

impl<N: Parameter, M: Parameter, S: Parameter> StudentT<N, M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.1.number()) / self.2.number()
    }

    /// Returns the logarithms of P(X ≤ x) and P(X > x), with their derivatives with respect to ν at fixed x.
    fn tails(&self, x: f64) -> LnTails<1> {
        let nu = self.0.number();
        let away = x - self.1.number();
        if away.is_infinite() {
            return if away > 0.0 { LnTails::ABOVE } else { LnTails::BELOW };
        }
        let z = away.abs() / self.2.number() / nu.sqrt();
        // logarithms of ν/(ν + t²) and t²/(ν + t²), computed directly because the fractions can underflow
        let (ln_x, ln_complement) = if z.is_finite() {
            (-ln_1p_square(z).0, -ln_1p_square(z.recip()).0)
        } else {
            (-2.0 * (ln_ratio(away.abs(), self.2.number()) - 0.5 * nu.ln()), 0.0)
        };
        let square = z * z;
        let (x, complement) = (1.0 / (1.0 + square), 1.0 / (1.0 + square.recip()));
        let at = Share { x, complement, ln_x, ln_complement };
        let beta = ln_beta_tails(0.5 * nu, 0.5, at).lower;
        // derivative with respect to ν through the argument x = ν/(ν + t²), which changes with ν at the rate x (1 −
        // x)/ν
        let moved = (at.ln_beta_power(0.5 * nu, 0.5) - beta.ln).exp() / nu;
        let slopes = [0.5 * beta.slopes[0] + moved];
        let outside = LnProbability { ln: beta.ln - LN_2, slopes };
        let inside = outside.complement();
        match away < 0.0 {
            true => LnTails { lower: outside, upper: inside },
            false => LnTails { lower: inside, upper: outside },
        }
    }

    /// Returns P(T > |t|) ≤ ½. This probability is half of the probability of values below ν/(ν + t²) under Beta(ν/2,
    /// ½).
    fn outside(&self, t: f64) -> f64 {
        let nu = self.0.number();
        let square = t * t / nu;
        let (x, y) = (1.0 / (1.0 + square), 1.0 / (1.0 + square.recip()));
        0.5 * regularised_beta(0.5 * nu, 0.5, x, y).0
    }

    /// The quantile t > 0 with P(T > t) = q, for q ≤ ½.
    fn distance(&self, q: f64) -> f64 {
        let nu = self.0.number();
        let logit = if q > 0.25 {
            // use the probability of the interval (−t, t), because its computation has no cancellation for small t
            beta_logit_quantile(0.5 * nu, 0.5, 1.0 - 2.0 * q, Tail::Upper)
        } else {
            beta_logit_quantile(0.5 * nu, 0.5, 2.0 * q, Tail::Lower)
        };
        nu.sqrt() * (-0.5 * logit).exp()
    }
}

impl<N: Parameter, M: Parameter, S: Parameter> Univariate for StudentT<N, M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("StudentT", "degrees of freedom", self.0.number())?;
        DomainError::require_finite("StudentT", "location", self.1.number())?;
        DomainError::require_positive("StudentT", "scale", self.2.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        rand_distr::StudentT::new(self.0.number())
            .map_or(f64::NAN, |t| self.1.number() + self.2.number() * rng.sample(t))
    }

    fn mean(&self) -> f64 {
        if self.0.number() > 1.0 { self.1.number() } else { f64::NAN }
    }

    fn variance(&self) -> f64 {
        let nu = self.0.number();
        if nu > 2.0 {
            self.2.number().powi(2) * nu / (nu - 2.0)
        } else if nu > 1.0 {
            f64::INFINITY
        } else {
            f64::NAN
        }
    }

    fn cdf(&self, x: f64) -> f64 {
        let t = self.standardise(x);
        let outside = self.outside(t);
        if t < 0.0 { outside } else { 1.0 - outside }
    }

    fn sf(&self, x: f64) -> f64 {
        let t = self.standardise(x);
        let outside = self.outside(t);
        if t > 0.0 { outside } else { 1.0 - outside }
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        self.tails(x).tail(tail).ln
    }

    fn quantile(&self, p: f64) -> f64 {
        if p > 0.5 {
            return self.upper_quantile(1.0 - p);
        }
        self.1.number() - self.2.number() * self.distance(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        if q > 0.5 {
            return self.quantile(1.0 - q);
        }
        self.1.number() + self.2.number() * self.distance(q)
    }
}

/// Log of the normalising constant of the standard t distribution: ln Γ(ν/2 + ½) − ln Γ(ν/2) − ½ ln(ν/2) − ½ ln 2π. The
/// terms without ½ ln 2π vanish for large ν.
fn ln_shape(nu: f64) -> f64 {
    normaliser_terms(nu)[0]
}

/// Returns the value of [`ln_shape`], and twice the digamma terms in the derivative of `ln_shape` with respect to ν.
fn normaliser_terms(nu: f64) -> [f64; 2] {
    let terms = |nu: f64| {
        let (half, inverse) = (0.5 * nu, nu.recip());
        let stirling = stirling_error(half + 0.5) - stirling_error(half);
        let digammas = inverse.ln_1p() + ln_minus_digamma(half) - ln_minus_digamma(half + 0.5);
        [half * ln_1p_minus(inverse) + stirling - HALF_LN_2PI, digammas]
    };
    memoised!(terms, nu)
}

impl<R, N, M, S> UnivariateDensity<R> for StudentT<N, M, S>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    const CONSTANT: bool = N::CONSTANT && M::CONSTANT && S::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let scale = self.2.number();
        let inverse = scale.recip();
        let nu = lift::<R>(self.0);
        let z = (x.value() - self.1.number()) * inverse;
        let (value, [in_z, in_nu, share]) = standard(z, nu);
        let constant = normaliser(terms, self.0, ln_shape) - normaliser(terms, self.2, f64::ln);
        terms.add(
            constant + value,
            (
                (x, in_z * inverse),
                (self.0, in_nu),
                (self.1, -in_z * inverse),
                (self.2, (share - 1.0) * inverse),
            ),
        );
    }

    /// Uses the incomplete beta function. The derivatives with respect to location and scale follow from the
    /// derivatives with respect to both ends of the interval.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let [below, above] = [lower, upper].map(|x| self.tails(x));
        let (mass, share) = LnTails::between(&below, &above);
        if share < CANCELLED {
            return self.ln_mass_by_quadrature(lower, upper);
        }
        if mass.ln == f64::NEG_INFINITY {
            return R::from(mass.ln);
        }
        let (location, scale) = (self.1.number(), self.2.number());
        let plain = StudentT(self.0.number(), location, scale);
        // p(x)/P and (x − μ) p(x)/P, where P is the probability of the interval
        let density = |x: f64, tails: &LnTails<1>| {
            if x.is_infinite() {
                return [0.0; 2];
            }
            let away = x - location;
            let relative = match plain.ln_pdf(x) {
                // z² overflowed: use the tail approximation p(x) = ν P(beyond x)/|x − μ|
                f64::NEG_INFINITY => {
                    let beyond = tails.lower.ln.min(tails.upper.ln);
                    self.0.number() * (beyond - mass.ln).exp() / away.abs()
                }
                ln_pdf => (ln_pdf - mass.ln).exp(),
            };
            [relative, relative * away]
        };
        let (near, far) = (density(lower, &below), density(upper, &above));
        R::gather(
            mass.ln,
            (
                (self.0, mass.slopes[0]),
                (self.1, near[0] - far[0]),
                (self.2, (near[1] - far[1]) / scale),
            ),
        )
    }
}

/// Returns −½ (ν + 1) ln(1 + z²/ν), and an array with three entries: the derivatives of ln p with respect to z and to
/// ν, and (ν + 1) z²/(ν + z²).
#[inline]
fn standard<R: Scalar>(z: f64, unknown_nu: R) -> (f64, [f64; 3]) {
    let nu = unknown_nu.value();
    let half = 0.5 * nu;
    let root = nu.sqrt();
    let (ln_square, slope, share) = ln_1p_square(z / root);
    let in_nu = if unknown_nu.is_constant() {
        0.0
    } else {
        let inverse = nu.recip();
        0.5 * (normaliser_terms(nu)[1] - inverse - ln_square + share * (1.0 + inverse))
    };
    (-(half + 0.5) * ln_square, [-(nu + 1.0) * slope / root, in_nu, (nu + 1.0) * share])
}
