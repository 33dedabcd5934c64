//! Truncated distributions.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Truncated;
use crate::distribution::interval::Interval;
use crate::distribution::univariate::{
    NEAR_UNDERFLOW, Univariate, ln_inside, masses, quantile_within, sides,
};
use crate::distribution::univariate_density::{UnivariateDensity, ln_probability};
use crate::number::scalar::Scalar;
use crate::special::Tail;
use crate::term::accumulator::Accumulator;
use crate::transform::Support;

crate::univariate!([D: Univariate] Truncated<D>);

impl<D: Univariate> Truncated<D> {
    /// Whether the support is bounded. All moments of the truncated distribution then exist, even if the moments of
    /// the inner distribution do not.
    fn is_bounded(&self) -> bool {
        self.quantile(0.0).is_finite() && self.upper_quantile(0.0).is_finite()
    }

    /// Probability of the interval `part` under the truncated distribution; NaN if an end of `part` is NaN.
    fn share(&self, part: Interval) -> f64 {
        if part.lower().is_nan() || part.upper().is_nan() {
            return f64::NAN;
        }
        let inside = masses(&self.inner, self.interval).1;
        if inside < NEAR_UNDERFLOW {
            return self.ln_share(part).exp();
        }
        masses(&self.inner, self.interval.and(part)).1 / inside
    }

    /// Log probability of the interval `part` under the truncated distribution.
    fn ln_share(&self, part: Interval) -> f64 {
        let part = self.interval.and(part);
        if part.lower() >= part.upper() {
            return f64::NEG_INFINITY;
        }
        let [part, whole] = [part, self.interval].map(|i| ln_inside(&self.inner, i).0);
        part - whole
    }
}

impl<D: Univariate> Univariate for Truncated<D> {
    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()?;
        self.interval.validate("truncate")?;
        let inside = masses(&self.inner, self.interval).1;
        let holds = inside > 0.0 || ln_inside(&self.inner, self.interval).0 > f64::NEG_INFINITY;
        DomainError::require(holds, "truncate", "probability of the interval", "positive", inside)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        let inner_mean = self.inner.mean();
        if !inner_mean.is_finite() && !self.is_bounded() {
            return inner_mean;
        }
        let (up, down) = sides(self, 1);
        self.quantile(0.5) + (up - down)
    }

    fn variance(&self) -> f64 {
        let inner_variance = self.inner.variance();
        if !inner_variance.is_finite() && !self.is_bounded() {
            return inner_variance;
        }
        let ((up, down), (up_square, down_square)) = (sides(self, 1), sides(self, 2));
        up_square + down_square - (up - down).powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        if x <= self.interval.lower() { 0.0 } else { self.share(Interval::new(..x)) }
    }

    fn sf(&self, x: f64) -> f64 {
        if x >= self.interval.upper() { 0.0 } else { self.share(Interval::new(x..)) }
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        let share = match tail {
            Tail::Lower => self.cdf(x),
            Tail::Upper => self.sf(x),
        };
        if share > NEAR_UNDERFLOW {
            return share.ln();
        }
        match tail {
            Tail::Lower => self.ln_share(Interval::new(..x)),
            Tail::Upper => self.ln_share(Interval::new(x..)),
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        quantile_within(&self.inner, self.interval, p, 1.0 - p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        quantile_within(&self.inner, self.interval, 1.0 - q, q)
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
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        self.inner.add_ln_pdf(x, terms);
        if !(D::CONSTANT && terms.leave_out_constants()) {
            terms.add_number(-ln_probability(&self.inner, self.interval));
        }
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let part = self.interval.and(Interval::new(lower..upper));
        ln_probability(&self.inner, part) - ln_probability(&self.inner, self.interval)
    }

    fn chosen_ends(&self) -> Option<(f64, f64)> {
        let (lower, upper) = self.support().bounds();
        if lower.is_finite() && upper.is_finite() {
            return Some((lower, upper));
        }
        // two kinds of truncation are not reported as bounds of a prior: truncation at zero, because zero is the
        // natural bound of a scale; and truncation of a distribution with unknown parameters, because it is part of
        // the model and not a range chosen for a prior
        let (end, cut) = match lower.is_finite() {
            true => (lower, self.interval.lower()),
            false => (upper, self.interval.upper()),
        };
        let chosen = end.is_finite() && end == cut && end != 0.0;
        (chosen && D::CONSTANT).then_some((lower, upper))
    }
}
