//! The Weibull distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{Tail, ln_gamma, ln_one_minus_exp, ln_ratio};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Weibull distribution with shape α and scale σ: distribution of the strength of the weakest of many links.
///
/// ln p(x) = ln α − ln σ + (α − 1) ln(x/σ) − (x/σ)^α, for x > 0 and α, σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // the characteristic strength: 63 % of the specimens fail below it
/// let strength_mpa = Weibull(12.0, 340.0);
/// assert!((strength_mpa.sf(340.0) - (-1.0f64).exp()).abs() < 1e-16);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 21.
#[derive(Clone, Copy, Debug)]
pub struct Weibull<A, S>(pub A, pub S);

crate::univariate!([A: Parameter, S: Parameter] Weibull<A, S>);

impl<A: Parameter, S: Parameter> Weibull<A, S> {
    /// Cumulative hazard −ln P(X > x) = (x/σ)^α.
    fn hazard(&self, x: f64) -> f64 {
        let (x, scale) = (x.max(0.0), self.1.number());
        let ratio = x / scale;
        if x > 0.0 && x.is_finite() && !ratio.is_normal() {
            return self.ln_hazard(x).exp();
        }
        ratio.powf(self.0.number())
    }

    /// Log of the cumulative hazard, which stays finite if the hazard overflows or underflows.
    fn ln_hazard(&self, x: f64) -> f64 {
        self.0.number() * ln_ratio(x.max(0.0), self.1.number())
    }

    /// Returns the value x at which the cumulative hazard is `hazard`.
    fn at_hazard(&self, hazard: f64) -> f64 {
        self.1.number() * hazard.powf(self.0.number().recip())
    }

    /// Returns ln(x p(x)) at u = ln(x/σ), and the derivatives of ln(x p(x)) with respect to u, α and σ.
    #[inline]
    fn ln_power(&self, u: f64) -> (f64, [f64; 3]) {
        let (shape, scale) = (self.0.number(), self.1.number());
        let hazard = (shape * u).exp();
        let rest = 1.0 - hazard;
        let in_u = shape * rest;
        // if the hazard overflows, −hazard dominates, and the sum of all terms could be ∞ − ∞
        let value = if hazard == f64::INFINITY { -hazard } else { shape.ln() + shape * u - hazard };
        (value, [in_u, shape.recip() + u * rest, -in_u / scale])
    }
}

impl<A: Parameter, S: Parameter> Weibull<A, S> {
    /// Log probability of an interval at whose ends the hazards are so small that they underflow. The probability is
    /// then the difference of the hazards.
    #[cold]
    fn ln_mass_at_zero<R: Scalar>(&self, lower: f64, upper: f64) -> R
    where
        A: Datum<R>,
        S: Datum<R>,
    {
        let (shape, scale) = (self.0.number(), self.1.number());
        let [near, far] = [lower, upper].map(|x| ln_ratio(x.max(0.0), scale));
        let ratio = (shape * (near - far)).exp();
        let rest = -(shape * (near - far)).exp_m1();
        let from_near = if ratio == 0.0 { 0.0 } else { ratio * near };
        let value = shape * far + rest.ln();
        R::gather(value, ((self.0, (far - from_near) / rest), (self.1, -shape / scale)))
    }
}

impl<A: Parameter, S: Parameter> Univariate for Weibull<A, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Weibull", "shape", self.0.number())?;
        DomainError::require_positive("Weibull", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        self.at_hazard(unit)
    }

    fn mean(&self) -> f64 {
        self.1.number() * ln_gamma(1.0 + self.0.number().recip()).exp()
    }

    fn variance(&self) -> f64 {
        let inverse = self.0.number().recip();
        let (first, second) = (ln_gamma(1.0 + inverse), ln_gamma(1.0 + 2.0 * inverse));
        -self.1.number().powi(2) * second.exp() * (2.0 * first - second).exp_m1()
    }

    fn cdf(&self, x: f64) -> f64 {
        -(-self.hazard(x)).exp_m1()
    }

    fn sf(&self, x: f64) -> f64 {
        (-self.hazard(x)).exp()
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        let hazard = self.hazard(x);
        match tail {
            Tail::Lower if hazard < f64::MIN_POSITIVE => self.ln_hazard(x),
            Tail::Lower => ln_one_minus_exp(hazard),
            Tail::Upper => -hazard,
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        self.at_hazard(-(-p).ln_1p())
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.at_hazard(-q.ln())
    }
}

impl<R, A, S> UnivariateDensity<R> for Weibull<A, S>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let (v, scale) = (x.value(), self.1.number());
        if v == 0.0 {
            // limit of ln p at x = 0, which depends on the factor x^{α − 1}
            let shape = self.0.number();
            if shape == 1.0 {
                return terms.add(-scale.ln(), ((self.1, -scale.recip()),));
            }
            return terms.add_number(R::from((1.0 - shape) * f64::INFINITY));
        }
        let (value, [in_u, in_shape, in_scale]) = self.ln_power(ln_ratio(v, scale));
        terms.add(value - v.ln(), ((x, (in_u - 1.0) / v), (self.0, in_shape), (self.1, in_scale)));
    }

    /// Computes ln(e^{−G} − e^{−H}) = −G + ln(1 − e^{−(H − G)}) for the hazards G ≤ H at the ends, without cancellation
    /// in the tails.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (shape, scale) = (self.0.number(), self.1.number());
        let [less, more] = [lower, upper].map(|x| self.hazard(x));
        if more < f64::MIN_POSITIVE {
            return self.ln_mass_at_zero(lower, upper);
        }
        if less == f64::INFINITY {
            // the probability underflows so far that its logarithm overflows
            return R::from(f64::NEG_INFINITY);
        }
        let between = more - less;
        // weights of the derivatives with respect to both ends, divided by the probability of the interval; an end at
        // infinity or outside the support has the weight 0
        let near = if less == 0.0 { 0.0 } else { less / (-between).exp_m1() };
        let far = if more == f64::INFINITY { 0.0 } else { more / between.exp_m1() };
        let ln_ends = [(near, lower), (far, upper)]
            .map(|(weight, x)| if weight == 0.0 { 0.0 } else { weight * ln_ratio(x, scale) });
        let in_scale = -shape * (near + far) / scale;
        let partials = ((self.0, ln_ends[0] + ln_ends[1]), (self.1, in_scale));
        R::gather(ln_one_minus_exp(between) - less, partials)
    }
}
