//! A distribution conditioned on an interval.

use rand::Rng;

use super::{Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::special::integral_from_zero;
use crate::transform::Support;

/// A univariate distribution conditioned on (lower, upper); made by
/// [`Family::truncate`](super::Family::truncate).
///
/// ln p(x) = ln p₀(x) − ln P₀(lower < X < upper): the normaliser, and its derivatives in the
/// parameters, count in the density just as in the draws.
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
    pub(super) lower: f64,
    pub(super) upper: f64,
}

crate::univariate!([D: Univariate] Truncated<D>);

impl<D: Univariate> Truncated<D> {
    /// P₀(X ≤ lower), P₀(lower < X < upper) and P₀(X ≥ upper).
    fn masses(&self) -> (f64, f64, f64) {
        let (below, above) = (self.inner.cdf(self.lower), self.inner.sf(self.upper));
        let inside = if below > 0.5 {
            self.inner.sf(self.lower) - above
        } else if above > 0.5 {
            self.inner.cdf(self.upper) - below
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
        // bounds out of order hold no value, and `clamp` would panic
        if self.lower <= self.upper { x.clamp(self.lower, self.upper) } else { f64::NAN }
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
        DomainError::require(
            self.lower < self.upper,
            "truncate",
            "lower end",
            &format!("below the upper end {}", self.upper),
            self.lower,
        )?;
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
        let part =
            Truncated { inner: self.inner.clone(), lower: self.lower, upper: x.min(self.upper) };
        if x <= self.lower { 0.0 } else { part.masses().1 / self.masses().1 }
    }

    fn sf(&self, x: f64) -> f64 {
        let part =
            Truncated { inner: self.inner.clone(), lower: x.max(self.lower), upper: self.upper };
        if x >= self.upper { 0.0 } else { part.masses().1 / self.masses().1 }
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
    const SUMMANDS: bool = D::SUMMANDS;
    const CONSTANT: bool = D::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        self.inner.support().within(self.lower, self.upper)
    }

    #[inline(always)]
    fn ln_pdf(&self, x: R) -> R {
        let inner = self.inner.ln_pdf(x);
        if R::LEAN && D::CONSTANT {
            return inner;
        }
        inner - self.inner.ln_mass(self.lower, self.upper)
    }
}

/// ln P(lower < X < upper) for any density whose support does not move with its parameters:
/// its derivative in a parameter is the expectation of ∂ ln p over the interval.
pub(super) fn ln_mass_by_quadrature<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    lower: f64,
    upper: f64,
) -> R {
    let interval = Truncated { inner: distribution.clone(), lower, upper };
    let value = interval.masses().1.ln();
    if !R::DIFFERENTIABLE {
        return R::from(value);
    }
    let (a, b) = interval.support().bounds();
    let support = Support::Real.within(a, b);
    let ln_pdf = |y: f64| {
        let (x, log_jacobian) = support.constrain(y);
        (distribution.ln_pdf(R::from(x)), log_jacobian)
    };
    // parameters that are data leave nothing to integrate; a partial may vanish at one point,
    // not at three
    if [-0.9, 0.1, 1.3].into_iter().all(|y| ln_pdf(y).0.is_constant()) {
        return R::from(value);
    }
    let quartiles = [0.25, 0.5, 0.75].map(|u| support.unconstrain(interval.quantile(u)));
    R::fuse_iter(value, expectation(ln_pdf, quartiles))
}

/// Terms and normalised weights whose sum is the expectation of a term given as (ln p, log
/// Jacobian) over an unconstrained coordinate y: the trapezoid rule in t with
/// y = median + spread · sinh t (double exponential quadrature; Takahasi & Mori 1974, Publ.
/// RIMS 9).
fn expectation<R: Scalar>(
    ln_pdf: impl Fn(f64) -> (R, f64),
    [first, median, third]: [f64; 3],
) -> Vec<(R, f64)> {
    const STEP: f64 = 1.0 / 12.0;
    const REACH: i32 = 54;
    let spread = (third - first).abs().max(f64::MIN_POSITIVE);
    let mut terms: Vec<(R, f64)> = (-REACH..=REACH)
        .filter_map(|i| {
            let t = f64::from(i) * STEP;
            let (term, log_jacobian) = ln_pdf(median + spread * t.sinh());
            let weight = (term.value() + log_jacobian).exp() * t.cosh();
            (weight > 0.0 && weight.is_finite()).then_some((term, weight))
        })
        .collect();
    let total: f64 = terms.iter().map(|(_, w)| w).sum();
    terms.iter_mut().for_each(|(_, w)| *w /= total);
    terms
}
