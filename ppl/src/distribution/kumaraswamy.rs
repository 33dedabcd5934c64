//! The Kumaraswamy distribution.

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic, softplus};
use crate::special::ln_beta;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Kumaraswamy distribution on (0, 1): like a beta, with distribution functions in closed form.
///
/// ln p(x) = ln a + ln b + (a − 1) ln x + (b − 1) ln(1 − xᵃ), for a, b > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let share = Kumaraswamy(2.0, 3.0);
/// assert!((share.sf(0.5) - 0.75f64.powi(3)).abs() < 1e-15);
/// ```
///
/// # References
/// Kumaraswamy (1980), doi:10.1016/0022-1694(80)90036-0.
#[derive(Clone, Copy, Debug)]
pub struct Kumaraswamy<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] Kumaraswamy<A, B>);

impl<A: Parameter, B: Parameter> Kumaraswamy<A, B> {
    /// The cumulative hazard −ln P(X > x) = −b ln(1 − xᵃ).
    fn hazard(&self, x: f64) -> f64 {
        -self.1.number() * ln_complement(self.0.number() * x.clamp(0.0, 1.0).ln())
    }

    /// The x with this hazard.
    fn at_hazard(&self, hazard: f64) -> f64 {
        ((-(-hazard / self.1.number()).exp_m1()).ln() / self.0.number()).exp()
    }

    /// E Xⁿ = b B(1 + n/a, b).
    fn moment(&self, n: f64) -> f64 {
        let b = self.1.number();
        b * ln_beta(1.0 + n / self.0.number(), b).exp()
    }

    /// ln(x p(x)) at l = ln x with its derivatives in l, a and b.
    #[inline]
    fn ln_power(&self, l: f64) -> (f64, [f64; 3]) {
        let (a, b) = (self.0.number(), self.1.number());
        let complement = ln_complement(a * l);
        // (b − 1) xᵃ/(1 − xᵃ)
        let pull = (b - 1.0) / (-a * l).exp_m1();
        (
            (a * b).ln() + a * l + (b - 1.0) * complement,
            [a * (1.0 - pull), a.recip() + l * (1.0 - pull), b.recip() + complement],
        )
    }
}

/// ln(1 − eᵗ) for t ≤ 0.
fn ln_complement(t: f64) -> f64 {
    crate::special::ln_one_minus_exp(-t)
}

impl<A: Parameter, B: Parameter> Univariate for Kumaraswamy<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Kumaraswamy", "first shape", self.0.number())?;
        DomainError::require_positive("Kumaraswamy", "second shape", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        self.at_hazard(unit)
    }

    fn mean(&self) -> f64 {
        self.moment(1.0)
    }

    fn variance(&self) -> f64 {
        self.moment(2.0) - self.moment(1.0).powi(2)
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

impl<R, A, B> UnivariateDensity<R> for Kumaraswamy<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    const NATURAL_ENDS: bool = true;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Between(R::from(0.0), R::from(1.0))
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let (a, b, v) = (self.0.number(), self.1.number(), x.value());
        // at an end the density is 0, ∞ or, for a unit shape, the other one
        if v == 0.0 && a == 1.0 {
            return terms.add(b.ln(), ((self.1, b.recip()),));
        }
        if v == 1.0 && b == 1.0 {
            return terms.add(a.ln(), ((self.0, a.recip()),));
        }
        if v == 0.0 || v == 1.0 {
            let shape = if v == 0.0 { a } else { b };
            return terms.add_number(R::from((1.0 - shape) * f64::INFINITY));
        }
        let l = v.ln();
        let (value, [in_log, in_a, in_b]) = self.ln_power(l);
        terms.add(value - l, ((x, (in_log - 1.0) / v), (self.0, in_a), (self.1, in_b)));
    }

    /// The Jacobian x (1 − x) cancels 1/x, and 1 − x keeps its digits near 1.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let (p, q) = logistic(y.value());
        let (value, [in_log, in_a, in_b]) = self.ln_power(-softplus(-y.value()));
        terms.add(
            value - softplus(y.value()),
            ((y, in_log * q - p), (self.0, in_a), (self.1, in_b)),
        );
        y.unary(p, p * q)
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (a, b) = (self.0.number(), self.1.number());
        let [low, high] = [lower, upper].map(|x| {
            let l = x.clamp(0.0, 1.0).ln();
            (self.hazard(x), [b * l / (-a * l).exp_m1(), -ln_complement(a * l)])
        });
        ln_mass_by_hazard([lift(self.0), lift(self.1)], low, high)
    }
}
