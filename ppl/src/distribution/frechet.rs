//! The Fréchet distribution.

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{ln_gamma, ln_ratio};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Fréchet distribution with shape α and scale σ: the largest of many heavy-tailed numbers.
///
/// ln p(x) = ln α − ln σ − (α + 1) ln(x/σ) − (x/σ)^{−α}, for x > 0 and α, σ > 0. The mean exists
/// for α > 1, the variance for α > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let largest_flaw_mm = Frechet(3.0, 0.2);
/// assert!((largest_flaw_mm.cdf(0.2) - (-1.0f64).exp()).abs() < 1e-16);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 22.
#[derive(Clone, Copy, Debug)]
pub struct Frechet<A, S>(pub A, pub S);

crate::univariate!([A: Parameter, S: Parameter] Frechet<A, S>);

impl<A: Parameter, S: Parameter> Frechet<A, S> {
    /// −ln P(X ≤ x) = (x/σ)^{−α}.
    fn hazard(&self, x: f64) -> f64 {
        (x.max(0.0) / self.1.number()).powf(-self.0.number())
    }

    /// The x where that has this value.
    fn at_hazard(&self, hazard: f64) -> f64 {
        self.1.number() * hazard.powf(-self.0.number().recip())
    }

    /// ln(x p(x)) at u = ln(x/σ) with its derivatives in u, α and σ.
    #[inline]
    fn ln_power(&self, u: f64) -> (f64, [f64; 3]) {
        let (shape, scale) = (self.0.number(), self.1.number());
        let hazard = (-shape * u).exp();
        let rest = hazard - 1.0;
        let in_u = shape * rest;
        // which outgrows every power
        let value = if hazard == f64::INFINITY { -hazard } else { shape.ln() - shape * u - hazard };
        (value, [in_u, shape.recip() + u * rest, -in_u / scale])
    }

    /// ln Γ(1 − n/α), infinite where the moment does not exist.
    fn ln_moment(&self, n: f64) -> f64 {
        let argument = 1.0 - n / self.0.number();
        if argument > 0.0 { ln_gamma(argument) } else { f64::INFINITY }
    }
}

impl<A: Parameter, S: Parameter> Univariate for Frechet<A, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Frechet", "shape", self.0.number())?;
        DomainError::require_positive("Frechet", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        self.at_hazard(unit)
    }

    fn mean(&self) -> f64 {
        self.1.number() * self.ln_moment(1.0).exp()
    }

    fn variance(&self) -> f64 {
        let (first, second) = (self.ln_moment(1.0), self.ln_moment(2.0));
        if first == f64::INFINITY {
            return f64::NAN;
        }
        -self.1.number().powi(2) * second.exp() * (2.0 * first - second).exp_m1()
    }

    fn cdf(&self, x: f64) -> f64 {
        (-self.hazard(x)).exp()
    }

    fn sf(&self, x: f64) -> f64 {
        -(-self.hazard(x)).exp_m1()
    }

    fn quantile(&self, p: f64) -> f64 {
        self.at_hazard(-p.ln())
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.at_hazard(-(-q).ln_1p())
    }
}

impl<R, A, S> UnivariateDensity<R> for Frechet<A, S>
where
    R: Scalar,
    A: Parameter + Datum<R>,
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
        let (value, [in_u, in_shape, in_scale]) = self.ln_power(ln_ratio(v, self.1.number()));
        terms.add(value - v.ln(), ((x, (in_u - 1.0) / v), (self.0, in_shape), (self.1, in_scale)));
    }

    /// The Jacobian cancels 1/x.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let (value, partials) = self.ln_power(y.value() - self.1.number().ln());
        let [in_y, in_first, in_second] = partials;
        terms.add(value, ((y, in_y), (self.0, in_first), (self.1, in_second)));
        y.exp()
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (shape, scale) = (self.0.number(), self.1.number());
        let unknowns = [lift(self.0), lift(self.1)];
        let [low, high] = [lower, upper].map(|x| (x.max(0.0) / scale).ln());
        if shape * low > 40.0 {
            // so far up, 1 − e^{−G} is G = (x/σ)^{−α}, which may underflow
            let ends = [low, high].map(|u| (shape * u, [u, -shape / scale]));
            return ln_mass_by_hazard(unknowns, ends[0], ends[1]);
        }
        let ends = [low, high].map(|u| {
            let hazard = (-shape * u).exp();
            (hazard, [-hazard * u, shape * hazard / scale])
        });
        ln_mass_by_hazard(unknowns, ends[1], ends[0])
    }
}
