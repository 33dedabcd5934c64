//! The Pareto distribution.

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Pareto distribution with smallest value m and shape α.
///
/// ln p(x) = ln α + α ln m − (α + 1) ln x, for x ≥ m and m, α > 0. The mean exists for α > 1, the
/// variance for α > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let size_mm = Pareto(0.5, 3.0);
/// assert_eq!(size_mm.mean(), 0.75);
/// assert!((size_mm.sf(1.0) - 0.125).abs() < 1e-16);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 20.
#[derive(Clone, Copy, Debug)]
pub struct Pareto<M, A>(pub M, pub A);

crate::univariate!([M: Parameter, A: Parameter] Pareto<M, A>);

impl<M: Parameter, A: Parameter> Pareto<M, A> {
    /// ln(x/m), which is Exponential(α).
    fn excess(&self, x: f64) -> f64 {
        let least = self.0.number();
        ((x.max(least) - least) / least).ln_1p()
    }
}

impl<M: Parameter, A: Parameter> Univariate for Pareto<M, A> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Pareto", "smallest value", self.0.number())?;
        DomainError::require_positive("Pareto", "shape", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        self.0.number() * (unit / self.1.number()).exp()
    }

    fn mean(&self) -> f64 {
        let shape = self.1.number();
        if shape > 1.0 { self.0.number() * shape / (shape - 1.0) } else { f64::INFINITY }
    }

    fn variance(&self) -> f64 {
        let shape = self.1.number();
        if shape > 2.0 {
            (self.0.number() / (shape - 1.0)).powi(2) * shape / (shape - 2.0)
        } else if shape > 1.0 {
            f64::INFINITY
        } else {
            f64::NAN
        }
    }

    fn cdf(&self, x: f64) -> f64 {
        -(-self.1.number() * self.excess(x)).exp_m1()
    }

    fn sf(&self, x: f64) -> f64 {
        (-self.1.number() * self.excess(x)).exp()
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() * (-(-p).ln_1p() / self.1.number()).exp()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() * (-q.ln() / self.1.number()).exp()
    }
}

impl<R, M, A> UnivariateDensity<R> for Pareto<M, A>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    A: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Above(lift(self.0))
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let (least, shape, v) = (self.0.number(), self.1.number(), x.value());
        let excess = self.excess(v);
        terms.add(
            shape.ln() - shape * excess - v.ln(),
            ((x, -(shape + 1.0) / v), (self.0, shape / least), (self.1, shape.recip() - excess)),
        );
    }

    /// The smallest value moves an end that the interval does not cut off.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (least, shape) = (self.0.number(), self.1.number());
        let [low, high] = [lower, upper].map(|x| {
            let excess = self.excess(x);
            let in_least = if x > least { -shape / least } else { 0.0 };
            (shape * excess, [in_least, excess])
        });
        ln_mass_by_hazard([lift(self.0), lift(self.1)], low, high)
    }
}
