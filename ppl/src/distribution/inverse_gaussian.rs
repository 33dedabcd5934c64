//! The inverse Gaussian distribution.

use rand::Rng;

use super::{Parameter, Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, Tail, ln_ratio, mills_ratio, normal_cdf, tail_quantile};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Inverse Gaussian (Wald) distribution with mean μ and shape λ: when a drifting Brownian motion
/// first reaches a level.
///
/// ln p(x) = ½ ln λ − ½ ln 2π − 3/2 ln x − λ (x − μ)²/(2 μ² x), for x > 0 and μ, λ > 0. The
/// variance is μ³/λ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let passage_s = InverseGaussian(2.0, 8.0);
/// assert_eq!((passage_s.mean(), passage_s.variance()), (2.0, 1.0));
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 15.
#[derive(Clone, Copy, Debug)]
pub struct InverseGaussian<M, L>(pub M, pub L);

crate::univariate!([M: Parameter, L: Parameter] InverseGaussian<M, L>);

impl<M: Parameter, L: Parameter> InverseGaussian<M, L> {
    /// √(λ/x) (x/μ − 1) and √(λ/x) (x/μ + 1), whose squares differ by 4 λ/μ.
    fn bounds(&self, x: f64) -> [f64; 2] {
        let root = (self.1.number() / x).sqrt();
        let ratio = x / self.0.number();
        [root * (ratio - 1.0), root * (ratio + 1.0)]
    }

    /// P(X ≤ x) and P(X > x), the smaller one without cancellation.
    fn tails(&self, x: f64) -> (f64, f64) {
        if x <= 0.0 {
            return (0.0, 1.0);
        }
        if x == f64::INFINITY {
            return (1.0, 0.0);
        }
        let [a, b] = self.bounds(x);
        // e^{2λ/μ} Φ(−b) = φ(a) R(b)
        let density = (-0.5 * a * a - HALF_LN_2PI).exp();
        if a < 0.0 {
            let below = normal_cdf(a) + density * mills_ratio(b);
            (below, 1.0 - below)
        } else {
            let above = density * (mills_ratio(a) - mills_ratio(b));
            (1.0 - above, above)
        }
    }

    /// ln(x p(x)) with its derivatives in ln x, μ and λ.
    #[inline]
    fn ln_power(&self, x: f64) -> (f64, [f64; 3]) {
        let (mean, shape) = (self.0.number(), self.1.number());
        let inverse = mean.recip();
        let deviation = (x - mean) * inverse;
        // (x − μ)²/(2 μ² x)
        let half_square = 0.5 * deviation * deviation / x;
        (
            0.5 * ln_ratio(shape, x) - HALF_LN_2PI - shape * half_square,
            [
                -0.5 - 0.5 * shape * deviation * (x + mean) * inverse / x,
                shape * deviation * inverse * inverse,
                0.5 / shape - half_square,
            ],
        )
    }

    fn invert(&self, p: f64, tail: Tail) -> f64 {
        tail_quantile(self.0.number().ln(), p, tail, |y| {
            let x = y.exp();
            let (below, above) = self.tails(x);
            (below, above, self.ln_power(x).0.exp())
        })
        .exp()
    }
}

impl<M: Parameter, L: Parameter> Univariate for InverseGaussian<M, L> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("InverseGaussian", "mean", self.0.number())?;
        DomainError::require_positive("InverseGaussian", "shape", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        rand_distr::InverseGaussian::new(self.0.number(), self.1.number())
            .map_or(f64::NAN, |inverse_gaussian| rng.sample(inverse_gaussian))
    }

    fn mean(&self) -> f64 {
        self.0.number()
    }

    fn variance(&self) -> f64 {
        self.0.number().powi(3) / self.1.number()
    }

    fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    fn sf(&self, x: f64) -> f64 {
        self.tails(x).1
    }

    fn quantile(&self, p: f64) -> f64 {
        self.invert(p, Tail::Lower)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.invert(q, Tail::Upper)
    }
}

impl<R, M, L> UnivariateDensity<R> for InverseGaussian<M, L>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    L: Parameter + Datum<R>,
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
        let (value, [in_log, in_mean, in_shape]) = self.ln_power(v);
        terms.add(value - v.ln(), ((x, (in_log - 1.0) / v), (self.0, in_mean), (self.1, in_shape)));
    }

    /// The Jacobian cancels one of the powers of x.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let x = y.exp();
        let (value, partials) = self.ln_power(x.value());
        let [in_y, in_mean, in_shape] = partials;
        terms.add(value, ((y, in_y), (self.0, in_mean), (self.1, in_shape)));
        x
    }
}
