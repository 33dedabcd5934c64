//! The Lomax distribution.

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Lomax (Pareto of the second kind) distribution with scale λ and shape α, on the positive
/// numbers.
///
/// ln p(x) = ln α − ln λ − (α + 1) ln(1 + x/λ), for x > 0 and λ, α > 0. The mean exists for
/// α > 1, the variance for α > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let wait_s = Lomax(2.0, 3.0);
/// assert_eq!(wait_s.mean(), 1.0);
/// assert!((wait_s.sf(2.0) - 0.125).abs() < 1e-16);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 20.
#[derive(Clone, Copy, Debug)]
pub struct Lomax<L, A>(pub L, pub A);

crate::univariate!([L: Parameter, A: Parameter] Lomax<L, A>);

impl<L: Parameter, A: Parameter> Lomax<L, A> {
    /// ln(1 + x/λ), which is Exponential(α).
    fn excess(&self, x: f64) -> f64 {
        (x.max(0.0) / self.0.number()).ln_1p()
    }
}

impl<L: Parameter, A: Parameter> Univariate for Lomax<L, A> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Lomax", "scale", self.0.number())?;
        DomainError::require_positive("Lomax", "shape", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let unit: f64 = rng.sample(rand_distr::Exp1);
        self.0.number() * (unit / self.1.number()).exp_m1()
    }

    fn mean(&self) -> f64 {
        let shape = self.1.number();
        if shape > 1.0 { self.0.number() / (shape - 1.0) } else { f64::INFINITY }
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
        self.0.number() * (-(-p).ln_1p() / self.1.number()).exp_m1()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() * (-q.ln() / self.1.number()).exp_m1()
    }
}

impl<R, L, A> UnivariateDensity<R> for Lomax<L, A>
where
    R: Scalar,
    L: Parameter + Datum<R>,
    A: Parameter + Datum<R>,
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
        let (scale, shape, v) = (self.0.number(), self.1.number(), x.value());
        let excess = self.excess(v);
        let inverse = (scale + v).recip();
        terms.add(
            shape.ln() - scale.ln() - (shape + 1.0) * excess,
            (
                (x, -(shape + 1.0) * inverse),
                (self.0, (shape * (v / scale) - 1.0) * inverse),
                (self.1, shape.recip() - excess),
            ),
        );
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (scale, shape) = (self.0.number(), self.1.number());
        let [low, high] = [lower, upper].map(|x| {
            let excess = self.excess(x);
            (shape * excess, [-shape * x.max(0.0) / (scale * (scale + x.max(0.0))), excess])
        });
        ln_mass_by_hazard([lift(self.0), lift(self.1)], low, high)
    }
}
