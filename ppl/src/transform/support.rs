//! Supports of univariate distributions: intervals of the real line.

use crate::number::scalar::Scalar;
use crate::special::logistic;
use crate::term::accumulator::{Accumulator, Joined};

/// Support of a univariate density, with the smooth map of ℝ onto it.
///
/// | support | x(y) | log dx/dy |
/// |---|---|---|
/// | `Real` | y | 0 |
/// | `Above(a)` | a + eʸ | y |
/// | `Below(b)` | b − eʸ | y |
/// | `Between(a, b)` | a + (b − a) σ(y) | ln(b − a) − softplus(y) − softplus(−y) |
///
/// # References
/// Stan Reference Manual, "Constraint Transforms".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support<R> {
    /// The real line ℝ.
    Real,
    /// The interval (a, ∞).
    Above(R),
    /// The interval (−∞, b).
    Below(R),
    /// The interval (a, b).
    Between(R, R),
}

impl<R: Scalar> Support<R> {
    /// Returns the constrained value for the unconstrained coordinate `y`, and the log-Jacobian.
    #[inline(always)]
    pub fn constrain(&self, y: R) -> (R, R) {
        let log_jacobian = match *self {
            Self::Real => R::from(0.0),
            Self::Above(_) | Self::Below(_) => y,
            Self::Between(a, b) => {
                let (value, slope) = log_logistic_density(y.value(), |x| -x.ln());
                (b - a).ln() + y.unary(value, slope)
            }
        };
        (self.point(y), log_jacobian)
    }

    /// Returns the constrained value for the unconstrained coordinate `y`.
    #[inline(always)]
    pub(crate) fn point(&self, y: R) -> R {
        self.replace(y, &mut Joined::default())
    }

    /// Version of [`point`](Support::point) for a coordinate `y` that is not used afterwards.
    #[inline(always)]
    pub(crate) fn replace(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        match *self {
            Self::Real => y,
            Self::Above(end) | Self::Below(end) => {
                let away = y.value().exp();
                let slope = if let Self::Above(_) = self { away } else { -away };
                let x = end.value() + slope;
                if end.is_constant() {
                    return terms.replace(y, x, slope);
                }
                R::gather(x, ((end, 1.0), (y, slope)))
            }
            Self::Between(a, b) => {
                let (p, q) = logistic(y.value());
                let width = b.value() - a.value();
                // the distance is measured from the nearer end, to avoid rounding errors near both ends
                let x = if p < q { a.value() + width * p } else { b.value() - width * q };
                let slope = width * p * q;
                if a.is_constant() && b.is_constant() {
                    return terms.replace(y, x, slope);
                }
                R::gather(x, ((a, q), (b, p), (y, slope)))
            }
        }
    }

    /// Version of [`constrain`](Support::constrain) for a coordinate `y` that is not used afterwards; adds the
    /// log-Jacobian to `terms`.
    #[inline(always)]
    pub(crate) fn constrain_last_use(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        match *self {
            Self::Real => {}
            Self::Above(_) | Self::Below(_) => terms.add(y.value(), ((y, 1.0),)),
            Self::Between(a, b) => {
                let (value, slope) = log_logistic_density(y.value(), |x| terms.minus_ln(x));
                let width = b.value() - a.value();
                terms
                    .add(value + width.ln(), ((y, slope), (a, -width.recip()), (b, width.recip())));
            }
        }
        self.replace(y, terms)
    }

    /// Returns the unconstrained coordinate of the value `x`; infinite at an end of the support.
    pub fn unconstrain(&self, x: f64) -> f64 {
        match self {
            Self::Real => x,
            Self::Above(a) => (x - a.value()).ln(),
            Self::Below(b) => (b.value() - x).ln(),
            Self::Between(a, b) => ((x - a.value()) / (b.value() - x)).ln(),
        }
    }

    /// Returns the lower and the upper end of the support; ±∞ if the support has no such end.
    pub fn bounds(&self) -> (f64, f64) {
        match self {
            Self::Real => (f64::NEG_INFINITY, f64::INFINITY),
            Self::Above(a) => (a.value(), f64::INFINITY),
            Self::Below(b) => (f64::NEG_INFINITY, b.value()),
            Self::Between(a, b) => (a.value(), b.value()),
        }
    }

    /// Moves `x` to the nearest number inside the open support if it is at or beyond an end. If the end is 0, the
    /// result is the normal number of smallest magnitude, whose reciprocal is finite.
    pub fn inside(&self, x: f64) -> f64 {
        let (a, b) = self.bounds();
        let first = if a == 0.0 { f64::MIN_POSITIVE } else { a.next_up() };
        let last = if b == 0.0 { -f64::MIN_POSITIVE } else { b.next_down() };
        // `f64::max` and `f64::min` would replace NaN by an end
        if x < first {
            first
        } else if x > last {
            last
        } else {
            x
        }
    }

    /// Whether `x` lies in the closed support. A support with an end does not contain ±∞: the density is 0 there, but
    /// the formulas of some families give NaN.
    #[inline(always)]
    #[allow(clippy::manual_range_contains)] // the range method takes longer to compile
    pub fn contains(&self, x: f64) -> bool {
        match self {
            Self::Real => !x.is_nan(),
            Self::Above(a) => a.value() <= x && x < f64::INFINITY,
            Self::Below(b) => f64::NEG_INFINITY < x && x <= b.value(),
            Self::Between(a, b) => a.value() <= x && x <= b.value(),
        }
    }

    /// Lower and upper end; `None` if the support has no such end.
    fn ends(self) -> (Option<R>, Option<R>) {
        match self {
            Self::Real => (None, None),
            Self::Above(a) => (Some(a), None),
            Self::Below(b) => (None, Some(b)),
            Self::Between(a, b) => (Some(a), Some(b)),
        }
    }

    fn from_ends(ends: (Option<R>, Option<R>)) -> Self {
        match ends {
            (None, None) => Self::Real,
            (Some(a), None) => Self::Above(a),
            (None, Some(b)) => Self::Below(b),
            (Some(a), Some(b)) => Self::Between(a, b),
        }
    }

    /// Intersection of the support with `lower..upper`.
    #[inline]
    pub fn within(&self, lower: f64, upper: f64) -> Self {
        let (a, b) = self.ends();
        let cut = |end: f64| end.is_finite().then(|| R::from(end));
        // keep an end that is NaN, so that the density is undefined
        let keeps = |end: f64, holds: bool| holds || end.is_nan();
        let lower = a.filter(|a| keeps(a.value(), a.value() >= lower)).or_else(|| cut(lower));
        let upper = b.filter(|b| keeps(b.value(), b.value() <= upper)).or_else(|| cut(upper));
        Self::from_ends((lower, upper))
    }
}

/// Log density of the logistic distribution, ln σ(y) + ln σ(−y) = −|y| − 2 ln(1 + e^{−|y|}), and its derivative.
/// `minus_ln(x)` computes −ln x.
#[inline(always)]
pub(crate) fn log_logistic_density(y: f64, minus_ln: impl FnOnce(f64) -> f64) -> (f64, f64) {
    let (p, q) = logistic(y);
    // the rounding error of this sum is negligible compared with |y| or ln 2
    let sum = 1.0 + (-y.abs()).exp();
    (minus_ln(sum * sum) - y.abs(), q - p)
}

#[cfg(test)]
#[path = "../../tests/unit/transform_support.rs"]
mod tests;
