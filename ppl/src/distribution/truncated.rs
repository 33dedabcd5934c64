//! A distribution conditioned on an interval.

use rand::Rng;

use super::interval_mass::ln_probability;
use super::{Distribution, Family, Interval, Numeric, Univariate, UnivariateDensity, Unknown};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::special::integral_from_zero;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// A distribution of one number, real or count, conditioned on an interval; made by
/// [`Family::truncate`].
///
/// ln p(x) = ln p₀(x) − ln P₀(X ∈ interval): the normaliser, and its derivatives in the
/// parameters, count in the density just as in the draws. Counts respect whether an end belongs
/// to the interval: `Poisson(2.0).truncate(1.0..)` has no zeros.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let sd = Normal(0.15, 0.25).truncate(0.0..);
/// assert!((sd.mean() - 0.2648).abs() < 1e-4);
/// assert_eq!(sd.ln_density(&-0.1), f64::NEG_INFINITY);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Truncated<D> {
    pub(super) inner: D,
    pub(super) interval: Interval,
}

impl<D: Family> Family for Truncated<D> {}

impl<R: Scalar, D: Numeric<R>> Distribution<R> for Truncated<D> {
    type Value = D::Value;

    #[inline]
    fn ln_density(&self, x: &D::Value) -> R {
        Joined::of(|terms| self.add_terms(x, terms))
    }

    #[inline(always)]
    fn add_terms(&self, x: &D::Value, terms: &mut impl Terms<R>) {
        if !D::is_within(x, &self.interval) && !D::number(x).is_nan() {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        self.inner.add_terms(x, terms);
        if !(D::CONSTANT && terms.leave_out_constants()) {
            terms.add_number(-self.inner.ln_probability(self.interval));
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()?;
        self.interval.validate("truncate")?;
        let inside = self.inner.ln_probability(self.interval).value().exp();
        DomainError::require(inside > 0.0, "truncate", "mass inside", "positive", inside)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> D::Value {
        self.inner.draw_within(self.interval, rng)
    }
}

impl<R: Scalar, D: Numeric<R>> Numeric<R> for Truncated<D> {
    const CONSTANT: bool = D::CONSTANT;

    fn ln_probability(&self, interval: Interval) -> R {
        self.inner.ln_probability(self.interval.and(&interval))
            - self.inner.ln_probability(self.interval)
    }

    fn draw_within<G: Rng + ?Sized>(&self, interval: Interval, rng: &mut G) -> D::Value {
        self.inner.draw_within(self.interval.and(&interval), rng)
    }

    fn number(x: &D::Value) -> f64 {
        D::number(x)
    }

    fn is_within(x: &D::Value, interval: &Interval) -> bool {
        D::is_within(x, interval)
    }

    fn clamp(x: D::Value, interval: &Interval) -> D::Value {
        D::clamp(x, interval)
    }
}

impl<R: Scalar, D> Unknown<R> for Truncated<D>
where
    D: UnivariateDensity<R> + Numeric<R, Value = R>,
{
    #[inline]
    fn dim(&self) -> usize {
        1
    }

    #[inline(always)]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Terms<R>,
    ) -> R {
        super::constrain(self, next(), jacobian, terms)
    }

    fn unconstrain(&self, x: &R, out: &mut Vec<f64>) {
        out.push(UnivariateDensity::<R>::support(self).unconstrain(x.value()));
    }

    fn bounds(&self) -> Option<(f64, f64)> {
        let (lower, upper) = UnivariateDensity::<R>::support(self).bounds();
        if lower.is_finite() && upper.is_finite() {
            return Some((lower, upper));
        }
        // a cut at zero makes a scale, and with unknown parameters it is no prior but part of the
        // model, as where data are censored
        let (end, cut) = match lower.is_finite() {
            true => (lower, self.interval.lower()),
            false => (upper, self.interval.upper()),
        };
        let chosen = end.is_finite() && end == cut && end != 0.0;
        (chosen && <D as Numeric<R>>::CONSTANT).then_some((lower, upper))
    }
}

impl<D: Univariate> Truncated<D> {
    fn within(&self, interval: Interval) -> Self {
        Self { inner: self.inner.clone(), interval: self.interval.and(&interval) }
    }

    /// P₀(X ≤ lower), P₀(lower < X < upper) and P₀(X ≥ upper).
    pub(super) fn masses(&self) -> (f64, f64, f64) {
        let (lower, upper) = (self.interval.lower(), self.interval.upper());
        let (below, above) = (self.inner.cdf(lower), self.inner.sf(upper));
        let inside = if below > 0.5 {
            self.inner.sf(lower) - above
        } else if above > 0.5 {
            self.inner.cdf(upper) - below
        } else {
            1.0 - below - above
        };
        (below, inside, above)
    }

    /// The value with the shares `below` and `above` = 1 − below of the mass on either side,
    /// from the end that keeps digits.
    fn value_at(&self, below: f64, above: f64) -> f64 {
        let (outside_below, inside, outside_above) = self.masses();
        let p = outside_below + below * inside;
        let x = if p < 0.5 {
            self.inner.quantile(p)
        } else {
            self.inner.upper_quantile(outside_above + above * inside)
        };
        let (lower, upper) = (self.interval.lower(), self.interval.upper());
        // bounds out of order hold no value, and `clamp` would panic
        if lower <= upper { x.clamp(lower, upper) } else { f64::NAN }
    }

    /// n ∫ d^{n−1} P(|X − c| > d, one side) dd on both sides of the median c, upper and lower:
    /// the parts of E|X − c|ⁿ, by parts, so that distribution functions suffice.
    fn sides(&self, n: i32) -> (f64, f64) {
        let centre = self.quantile(0.5);
        let scale = self.quantile(0.75) - self.quantile(0.25);
        let weight = |d: f64| f64::from(n) * d.powi(n - 1);
        let length = self.upper_quantile(0.0) - centre;
        let up = integral_from_zero(|d| weight(d) * self.sf(centre + d), length, scale);
        let length = centre - self.quantile(0.0);
        let down = integral_from_zero(|d| weight(d) * self.cdf(centre - d), length, scale);
        (up, down)
    }

    /// Whether moments of the conditioned variable exist wherever those of the inner one do not.
    fn is_bounded(&self) -> bool {
        self.quantile(0.0).is_finite() && self.upper_quantile(0.0).is_finite()
    }
}

impl<D: Univariate> Univariate for Truncated<D> {
    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()?;
        self.interval.validate("truncate")?;
        let inside = self.masses().1;
        DomainError::require(inside > 0.0, "truncate", "mass inside", "positive", inside)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        let own = self.inner.mean();
        if !own.is_finite() && !self.is_bounded() {
            return own;
        }
        let (up, down) = self.sides(1);
        self.quantile(0.5) + (up - down)
    }

    fn variance(&self) -> f64 {
        let own = self.inner.variance();
        if !own.is_finite() && !self.is_bounded() {
            return own;
        }
        let ((up, down), (up_square, down_square)) = (self.sides(1), self.sides(2));
        up_square + down_square - (up - down).powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        let part = self.within(Interval::new(..x));
        if x <= self.interval.lower() { 0.0 } else { part.masses().1 / self.masses().1 }
    }

    fn sf(&self, x: f64) -> f64 {
        let part = self.within(Interval::new(x..));
        if x >= self.interval.upper() { 0.0 } else { part.masses().1 / self.masses().1 }
    }

    fn quantile(&self, p: f64) -> f64 {
        self.value_at(p, 1.0 - p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.value_at(1.0 - q, q)
    }
}

impl<R, D> UnivariateDensity<R> for Truncated<D>
where
    R: Scalar,
    D: UnivariateDensity<R>,
{
    const CONSTANT: bool = D::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        self.inner.support().within(self.interval.lower(), self.interval.upper())
    }

    #[inline(always)]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        self.inner.add_ln_pdf(x, terms);
        if !(D::CONSTANT && terms.leave_out_constants()) {
            terms.add_number(-ln_probability(&self.inner, self.interval));
        }
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let part = self.interval.and(&Interval::new(lower..upper));
        ln_probability(&self.inner, part) - ln_probability(&self.inner, self.interval)
    }
}
