//! The Rayleigh distribution.

use std::f64::consts::PI;

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::ln_ratio;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Rayleigh distribution: the length of a plane vector whose parts are Normal(0, σ).
///
/// ln p(x) = ln x − 2 ln σ − ½ (x/σ)², for x > 0 and σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let offset_mm = Rayleigh(0.1);
/// assert!((offset_mm.sf(0.1) - (-0.5f64).exp()).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1,
/// section 18.10.
#[derive(Clone, Copy, Debug)]
pub struct Rayleigh<S>(pub S);

crate::univariate!([S: Parameter] Rayleigh<S>);

impl<S: Parameter> Rayleigh<S> {
    /// The cumulative hazard −ln P(X > x) = ½ (x/σ)².
    fn hazard(&self, x: f64) -> f64 {
        0.5 * (x.max(0.0) / self.0.number()).powi(2)
    }

    /// The x with this hazard.
    fn at_hazard(&self, hazard: f64) -> f64 {
        self.0.number() * (2.0 * hazard).sqrt()
    }
}

impl<S: Parameter> Univariate for Rayleigh<S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Rayleigh", "scale", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        self.at_hazard(unit)
    }

    fn mean(&self) -> f64 {
        self.0.number() * (0.5 * PI).sqrt()
    }

    fn variance(&self) -> f64 {
        self.0.number().powi(2) * (2.0 - 0.5 * PI)
    }

    fn cdf(&self, x: f64) -> f64 {
        -(-self.hazard(x)).exp_m1()
    }

    fn sf(&self, x: f64) -> f64 {
        (-self.hazard(x)).exp()
    }

    fn quantile(&self, p: f64) -> f64 {
        self.at_hazard(-(-p).ln_1p())
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.at_hazard(-q.ln())
    }
}

impl<R, S> UnivariateDensity<R> for Rayleigh<S>
where
    R: Scalar,
    S: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let v = x.value();
        if v == 0.0 {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let scale = self.0.number();
        let inverse = scale.recip();
        let z = v * inverse;
        terms.add(
            ln_ratio(v, scale) - scale.ln() - 0.5 * z * z,
            ((x, v.recip() - z * inverse), (self.0, (z * z - 2.0) * inverse)),
        );
    }

    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let x = y.exp();
        let scale = self.0.number();
        let inverse = scale.recip();
        let square = (x.value() * inverse).powi(2);
        terms.add(
            2.0 * (y.value() - scale.ln()) - 0.5 * square,
            ((y, 2.0 - square), (self.0, (square - 2.0) * inverse)),
        );
        x
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let [low, high] = [lower, upper].map(|x| {
            let hazard = self.hazard(x);
            (hazard, [-2.0 * hazard / self.0.number()])
        });
        ln_mass_by_hazard([lift(self.0)], low, high)
    }
}
