//! The beta distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::interval_mass::CANCELLED;
use crate::distribution::traits::lift;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{
    LnTails, Share, Tail, beta_logit_quantile, ln_beta_power, ln_beta_tails, ln_minus_digamma,
    logistic, regularised_beta,
};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Beta distribution on (0, 1).
///
/// ln p(x) = (α − 1) ln x + (β − 1) ln(1 − x) − ln B(α, β), for α, β > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let share = Beta(2.0, 6.0);
/// assert_eq!(share.mean(), 0.25);
/// assert!((Beta(1.0, 1.0).ln_density(&0.3) as f64).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 25.
#[derive(Clone, Copy, Debug)]
pub struct Beta<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] Beta<A, B>);

/// Adds the limit of ln p at one end of the support. `shape` is the shape parameter that determines the density near
/// this end. The limit is −∞ for `shape` > 1, ∞ for `shape` < 1, and ln `other` for `shape` = 1, where `other` is the
/// other shape parameter.
#[inline]
fn add_at_end<R: Scalar, P: Parameter + Datum<R>>(
    shape: impl Parameter,
    other: P,
    terms: &mut impl Accumulator<R>,
) {
    let (shape, b) = (shape.number(), other.number());
    if shape == 1.0 {
        terms.add(b.ln(), ((other, b.recip()),));
    } else {
        terms.add_number(R::from((1.0 - shape) * f64::INFINITY));
    }
}

impl<A: Parameter, B: Parameter> Beta<A, B> {
    fn parameters(&self) -> (f64, f64) {
        (self.0.number(), self.1.number())
    }

    /// Returns the logarithms of P(X ≤ x) and P(X > x), with their derivatives with respect to the shapes.
    fn tails(&self, x: f64) -> LnTails<2> {
        let (a, b) = self.parameters();
        if x <= 0.0 {
            LnTails::BELOW
        } else if x >= 1.0 {
            LnTails::ABOVE
        } else {
            ln_beta_tails(a, b, Share::new(x, 1.0 - x))
        }
    }

    /// Derivatives of ln p with respect to α and β, at x and `complement` = 1 − x; zero if both shapes are constant.
    #[inline]
    fn in_parameters<R: Scalar>(&self, x: f64, complement: f64) -> [f64; 2]
    where
        A: Datum<R>,
        B: Datum<R>,
    {
        if lift::<R>(self.0).is_constant() && lift::<R>(self.1).is_constant() {
            return [0.0; 2];
        }
        let (a, b) = self.parameters();
        let n = a + b;
        let both = ln_minus_digamma(n);
        [(a, x), (b, complement)].map(|(a, x)| (n * x).ln() - a.ln() + ln_minus_digamma(a) - both)
    }
}

impl<A: Parameter, B: Parameter> Univariate for Beta<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Beta", "first shape", self.0.number())?;
        DomainError::require_positive("Beta", "second shape", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let (a, b) = self.parameters();
        rand_distr::Beta::new(a, b).map_or(f64::NAN, |beta| rng.sample(beta))
    }

    fn mean(&self) -> f64 {
        let (a, b) = self.parameters();
        a / (a + b)
    }

    fn variance(&self) -> f64 {
        let (a, b) = self.parameters();
        let n = a + b;
        (a / n) * (b / n) / (n + 1.0)
    }

    fn cdf(&self, x: f64) -> f64 {
        let (a, b) = self.parameters();
        regularised_beta(a, b, x, 1.0 - x).0
    }

    fn sf(&self, x: f64) -> f64 {
        let (a, b) = self.parameters();
        regularised_beta(a, b, x, 1.0 - x).1
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        self.tails(x).tail(tail).ln
    }

    fn quantile(&self, p: f64) -> f64 {
        let (a, b) = self.parameters();
        if p > 0.5 {
            self.upper_quantile(1.0 - p)
        } else {
            logistic(beta_logit_quantile(a, b, p, Tail::Lower)).0
        }
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        let (a, b) = self.parameters();
        if q > 0.5 {
            self.quantile(1.0 - q)
        } else {
            logistic(beta_logit_quantile(a, b, q, Tail::Upper)).0
        }
    }
}

impl<R, A, B> UnivariateDensity<R> for Beta<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    const CONSTANT: bool = A::CONSTANT && B::CONSTANT;
    const NATURAL_ENDS: bool = true;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Between(R::from(0.0), R::from(1.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let (a, b) = self.parameters();
        let (v, complement) = (x.value(), 1.0 - x.value());
        if v == 0.0 {
            return add_at_end(self.0, self.1, terms);
        }
        if complement == 0.0 {
            return add_at_end(self.1, self.0, terms);
        }
        let value = ln_beta_power(a, b, v, complement) - v.ln() - complement.ln();
        let [in_a, in_b] = self.in_parameters::<R>(v, complement);
        terms.add(
            value,
            ((x, (a - 1.0) / v - (b - 1.0) / complement), (self.0, in_a), (self.1, in_b)),
        );
    }

    /// Uses the continued fraction of the incomplete beta function and its derivative.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let [below, above] = [lower, upper].map(|x| self.tails(x));
        let (mass, share) = LnTails::between(&below, &above);
        if share < CANCELLED {
            return self.ln_mass_by_quadrature(lower, upper);
        }
        let [in_a, in_b] = mass.slopes;
        R::gather(mass.ln, ((self.0, in_a), (self.1, in_b)))
    }

    /// The Jacobian x (1 − x) cancels terms of ln p, and 1 − x is computed without rounding errors near x = 1.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let (a, b) = self.parameters();
        let (p, q) = logistic(y.value());
        let [in_a, in_b] = self.in_parameters::<R>(p, q);
        terms.add(ln_beta_power(a, b, p, q), ((y, a * q - b * p), (self.0, in_a), (self.1, in_b)));
        terms.replace(y, p, p * q)
    }
}
