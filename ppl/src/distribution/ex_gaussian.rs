//! The exponentially modified normal distribution.

use rand::Rng;

use super::{Exponential, Normal, Parameter, Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, Tail, ln_normal_cdf, mills_ratio, normal_cdf, tail_quantile};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Exponentially modified normal distribution: the sum of Normal(μ, σ) and Exponential(λ).
///
/// ln p(x) = ln λ − λ (x − μ) + ½ λ²σ² + ln Φ((x − μ)/σ − λσ), for σ, λ > 0. The third argument is
/// the rate, as in Stan's `exp_mod_normal`; PyMC's `ExGaussian` takes the mean 1/λ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let reaction_s = ExGaussian(0.3, 0.05, 10.0);
/// assert!((reaction_s.mean() - 0.4).abs() < 1e-15);
/// ```
///
/// # References
/// Grushka (1972), doi:10.1021/ac60319a011.
#[derive(Clone, Copy, Debug)]
pub struct ExGaussian<M, S, L>(pub M, pub S, pub L);

crate::univariate!([M: Parameter, S: Parameter, L: Parameter] ExGaussian<M, S, L>);

impl<M: Parameter, S: Parameter, L: Parameter> ExGaussian<M, S, L> {
    /// z = (x − μ)/σ and r = λσ.
    fn standardise(&self, x: f64) -> (f64, f64) {
        let sd = self.1.number();
        ((x - self.0.number()) / sd, self.2.number() * sd)
    }

    fn invert(&self, p: f64, tail: Tail) -> f64 {
        let (mean, sd) = (self.mean(), self.variance().sqrt());
        let z = tail_quantile(0.0, p, tail, |z| {
            let x = mean + sd * z;
            let (position, r) = self.standardise(x);
            let (ln_pdf, _) = standard(position, r);
            (self.cdf(x), self.sf(x), ln_pdf.exp() * sd / self.1.number())
        });
        mean + sd * z
    }
}

/// ln p at z for σ = 1 and rate r, and the derivative of ln Φ(z − r).
#[inline]
fn standard(z: f64, r: f64) -> (f64, f64) {
    let w = z - r;
    let (ln_cdf, hazard) = ln_normal_cdf(w);
    let value = if w < 0.0 {
        // the squares cancel on paper: e^{−rz + r²/2} Φ(z − r) = φ(z) R(r − z)
        r.ln() - 0.5 * z * z - HALF_LN_2PI - hazard.ln()
    } else {
        r.ln() - r * (z - 0.5 * r) + ln_cdf
    };
    (value, hazard)
}

impl<M: Parameter, S: Parameter, L: Parameter> Univariate for ExGaussian<M, S, L> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("ExGaussian", "mean of the normal", self.0.number())?;
        DomainError::require_positive("ExGaussian", "sd of the normal", self.1.number())?;
        DomainError::require_positive("ExGaussian", "rate", self.2.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let normal = Normal(self.0, self.1).sample(rng);
        normal + Exponential(self.2).sample(rng)
    }

    fn mean(&self) -> f64 {
        self.0.number() + self.2.number().recip()
    }

    fn variance(&self) -> f64 {
        self.1.number().powi(2) + self.2.number().powi(-2)
    }

    fn cdf(&self, x: f64) -> f64 {
        let (z, r) = self.standardise(x);
        if z < 0.0 {
            // φ(z) (R(−z) − R(r − z))
            (-0.5 * z * z - HALF_LN_2PI).exp() * (mills_ratio(-z) - mills_ratio(r - z))
        } else {
            1.0 - self.sf(x)
        }
    }

    fn sf(&self, x: f64) -> f64 {
        let (z, r) = self.standardise(x);
        if z < 0.0 {
            1.0 - self.cdf(x)
        } else {
            let (ln_pdf, _) = standard(z, r);
            normal_cdf(-z) + (ln_pdf - r.ln()).exp()
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        self.invert(p, Tail::Lower)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.invert(q, Tail::Upper)
    }
}

impl<R, M, S, L> UnivariateDensity<R> for ExGaussian<M, S, L>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
    L: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let sd = self.1.number();
        let (z, r) = self.standardise(x.value());
        let (value, hazard) = standard(z, r);
        let in_x = (hazard - r) / sd;
        terms.add(
            value - sd.ln(),
            (
                (x, in_x),
                (self.0, -in_x),
                (self.1, (r * r - hazard * (z + r)) / sd),
                (self.2, self.2.number().recip() - sd * (z - r + hazard)),
            ),
        );
    }
}
