//! A distribution conditioned on an interval.

use rand::Rng;

use super::{Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::transform::Support;

/// A univariate distribution conditioned on (lower, upper); made by [`Family::truncate`].
///
/// ln p(x) = ln p₀(x) − ln P₀(lower < X < upper): the normaliser, and its derivatives in the
/// parameters, count in the density just as in the draws.
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

    /// The value with the share `u` of the mass below it, from the end that keeps digits.
    fn value_at(&self, u: f64) -> f64 {
        let (below, inside, above) = self.masses();
        let x = if below + u * inside < 0.5 {
            self.inner.quantile(below + u * inside)
        } else {
            self.inner.upper_quantile(above + (1.0 - u) * inside)
        };
        x.clamp(self.lower, self.upper)
    }

    fn expectation(&self, f: impl Fn(f64) -> f64) -> f64
    where
        D: UnivariateDensity<f64>,
    {
        nodes(&self.inner, self.lower, self.upper).into_iter().map(|(x, w)| w * f(x)).sum()
    }
}

impl<D: Univariate + UnivariateDensity<f64>> Univariate for Truncated<D> {
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
        self.value_at(rng.random())
    }

    fn mean(&self) -> f64 {
        self.expectation(|x| x)
    }

    fn variance(&self) -> f64 {
        let mean = self.mean();
        self.expectation(|x| (x - mean).powi(2))
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
        self.value_at(p)
    }
}

impl<R, D> UnivariateDensity<R> for Truncated<D>
where
    R: Scalar,
    D: UnivariateDensity<R> + UnivariateDensity<f64>,
{
    fn support(&self) -> Support<R> {
        UnivariateDensity::<R>::support(&self.inner).within(self.lower, self.upper)
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        self.inner.ln_pdf(x) - UnivariateDensity::<R>::ln_mass(&self.inner, self.lower, self.upper)
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
    let terms = nodes(distribution, lower, upper)
        .into_iter()
        .map(|(x, weight)| (distribution.ln_pdf(R::from(x)), weight));
    R::fuse_iter(value, terms)
}

/// Nodes and normalised weights for expectations over the interval: the trapezoid rule in t,
/// where y = y₀ + s sinh t is the unconstrained coordinate of x, centred by quantiles
/// (double exponential quadrature; Takahasi & Mori 1974, Publ. RIMS 9).
fn nodes<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    lower: f64,
    upper: f64,
) -> Vec<(f64, f64)> {
    const STEP: f64 = 1.0 / 12.0;
    const REACH: i32 = 54;
    let interval = Truncated { inner: distribution.clone(), lower, upper };
    let (a, b) = distribution.support().within(lower, upper).bounds();
    let support = Support::Real.within(a, b);
    let [first, centre, third] =
        [0.25, 0.5, 0.75].map(|u| support.unconstrain(interval.value_at(u)));
    let scale = (third - first).abs().max(f64::MIN_POSITIVE);
    let mut nodes: Vec<(f64, f64)> = (-REACH..=REACH)
        .filter_map(|i| {
            let t = f64::from(i) * STEP;
            let (x, log_jacobian) = support.constrain(centre + scale * t.sinh());
            let density = distribution.ln_pdf(R::from(x)).value() + log_jacobian;
            let weight = density.exp() * t.cosh();
            (weight > 0.0 && weight.is_finite()).then_some((x, weight))
        })
        .collect();
    let total: f64 = nodes.iter().map(|(_, w)| w).sum();
    nodes.iter_mut().for_each(|(_, w)| *w /= total);
    nodes
}
