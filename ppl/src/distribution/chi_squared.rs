//! The chi-squared distribution.

use rand::Rng;

use super::gamma::{Gamma, ln_power};
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Chi-squared distribution with ν degrees of freedom: Gamma(ν/2, ½).
///
/// ln p(x) = (ν/2 − 1) ln x − x/2 − ν/2 ln 2 − ln Γ(ν/2), for x > 0 and ν > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let misfit = ChiSquared(2.0);
/// assert!((misfit.sf(6.0) - (-3.0f64).exp()).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 18.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquared<N>(pub N);

crate::univariate!([N: Parameter] ChiSquared<N>);

impl<N: Parameter> ChiSquared<N> {
    fn gamma(&self) -> Gamma<f64, f64> {
        Gamma(0.5 * self.0.number(), 0.5)
    }
}

impl<N: Parameter> Univariate for ChiSquared<N> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("ChiSquared", "degrees of freedom", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.gamma().sample(rng)
    }

    fn mean(&self) -> f64 {
        self.0.number()
    }

    fn variance(&self) -> f64 {
        2.0 * self.0.number()
    }

    fn cdf(&self, x: f64) -> f64 {
        self.gamma().cdf(x)
    }

    fn sf(&self, x: f64) -> f64 {
        self.gamma().sf(x)
    }

    fn quantile(&self, p: f64) -> f64 {
        self.gamma().quantile(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.gamma().upper_quantile(q)
    }
}

impl<R, N> UnivariateDensity<R> for ChiSquared<N>
where
    R: Scalar,
    N: Parameter + Datum<R>,
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
            return terms.add_number(R::from(UnivariateDensity::<f64>::ln_pdf(&self.gamma(), 0.0)));
        }
        let shape = lift::<R>(self.0) * 0.5;
        let (value, in_shape) = ln_power(shape, 0.5 * v);
        terms.add(value - v.ln(), ((x, (shape.value() - 1.0) / v - 0.5), (shape, in_shape)));
    }

    /// The Jacobian cancels 1/x.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let x = y.exp();
        let shape = lift::<R>(self.0) * 0.5;
        let half = 0.5 * x.value();
        let (value, in_shape) = ln_power(shape, half);
        terms.add(value, ((y, shape.value() - half), (shape, in_shape)));
        x
    }
}
