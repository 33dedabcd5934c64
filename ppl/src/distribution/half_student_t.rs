//! The half-t distribution.

use std::f64::consts::LN_2;

use rand::Rng;

use super::student_t::{StudentT, ln_shape, standard};
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::ln_gamma;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Half-t distribution: |T| σ for a Student's T with ν degrees of freedom.
///
/// ln p(x) = ln 2 + ln Γ((ν + 1)/2) − ln Γ(ν/2) − ½ ln νπ − ln σ − ½ (ν + 1) ln(1 + (x/σ)²/ν), for
/// x ≥ 0 and ν, σ > 0. The mean exists for ν > 1, the variance for ν > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // one degree of freedom: the half-Cauchy distribution
/// let half_t: f64 = HalfStudentT(1.0, 2.5).ln_density(&4.0);
/// let half_cauchy: f64 = HalfCauchy(2.5).ln_density(&4.0);
/// assert!((half_t - half_cauchy).abs() < 1e-14);
/// ```
///
/// # References
/// Gelman (2006), doi:10.1214/06-BA117A.
#[derive(Clone, Copy, Debug)]
pub struct HalfStudentT<N, S>(pub N, pub S);

crate::univariate!([N: Parameter, S: Parameter] HalfStudentT<N, S>);

impl<N: Parameter, S: Parameter> HalfStudentT<N, S> {
    fn whole(&self) -> StudentT<N, f64, S> {
        StudentT(self.0, 0.0, self.1)
    }
}

impl<N: Parameter, S: Parameter> Univariate for HalfStudentT<N, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("HalfStudentT", "degrees of freedom", self.0.number())?;
        DomainError::require_positive("HalfStudentT", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.whole().sample(rng).abs()
    }

    fn mean(&self) -> f64 {
        let nu = self.0.number();
        if nu <= 1.0 {
            return f64::INFINITY;
        }
        // 2 √(ν/π) Γ((ν + 1)/2)/Γ(ν/2)/(ν − 1)
        let ratio = (ln_gamma(0.5 * nu + 0.5) - ln_gamma(0.5 * nu)).exp();
        2.0 * self.1.number() * (nu / std::f64::consts::PI).sqrt() * ratio / (nu - 1.0)
    }

    fn variance(&self) -> f64 {
        let nu = self.0.number();
        if nu > 2.0 {
            self.whole().variance() - self.mean().powi(2)
        } else if nu > 1.0 {
            f64::INFINITY
        } else {
            f64::NAN
        }
    }

    fn cdf(&self, x: f64) -> f64 {
        self.whole().inside(x.max(0.0) / self.1.number())
    }

    fn sf(&self, x: f64) -> f64 {
        2.0 * self.whole().sf(x.max(0.0))
    }

    fn quantile(&self, p: f64) -> f64 {
        self.whole().upper_quantile(0.5 - 0.5 * p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.whole().upper_quantile(0.5 * q)
    }
}

impl<R, N, S> UnivariateDensity<R> for HalfStudentT<N, S>
where
    R: Scalar,
    N: Parameter + Datum<R>,
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
        let scale = self.1.number();
        let inverse = scale.recip();
        let nu = lift::<R>(self.0);
        let z = x.value() * inverse;
        let (value, [in_z, in_nu, share]) = standard(z, nu);
        terms.add(
            LN_2 + ln_shape(nu.value()) + value - scale.ln(),
            ((x, in_z * inverse), (nu, in_nu), (self.1, (share - 1.0) * inverse)),
        );
    }

    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let x = y.exp();
        let scale = self.1.number();
        let inverse = scale.recip();
        let nu = lift::<R>(self.0);
        let (value, [_, in_nu, share]) = standard(x.value() * inverse, nu);
        terms.add(
            LN_2 + ln_shape(nu.value()) + value - scale.ln() + y.value(),
            ((y, 1.0 - share), (nu, in_nu), (self.1, (share - 1.0) * inverse)),
        );
        x
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let whole: R = self.whole().ln_mass(lower.max(0.0), upper);
        whole + LN_2
    }
}
