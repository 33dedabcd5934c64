//! Logarithms of probabilities, with their derivatives with respect to parameters.

use super::{Tail, ln_one_minus_exp};

/// The constant ln 0.9. For a probability P above 0.9, the complement 1 − P computed from P is inaccurate.
pub(super) const CLOSE_TO_ONE: f64 = -0.105_360_515_657_826_3;

/// Logarithm of a probability and its derivatives with respect to `N` parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LnProbability<const N: usize> {
    /// ln P; −∞ for an impossible event.
    pub ln: f64,
    /// Derivative of ln P with respect to each parameter.
    pub slopes: [f64; N],
}

impl<const N: usize> LnProbability<N> {
    /// The probability 0, for all values of the parameters.
    pub const IMPOSSIBLE: Self = Self { ln: f64::NEG_INFINITY, slopes: [0.0; N] };
    /// The probability 1, for all values of the parameters.
    pub const CERTAIN: Self = Self { ln: 0.0, slopes: [0.0; N] };
    /// NaN, the result for invalid parameters.
    pub(super) const UNDEFINED: Self = Self { ln: f64::NAN, slopes: [f64::NAN; N] };

    /// Creates a log probability. A logarithm that is positive because of rounding is set to 0.
    pub(super) fn new(ln: f64, slopes: [f64; N]) -> Self {
        Self { ln: if ln > 0.0 { 0.0 } else { ln }, slopes }
    }

    /// Returns the probability 1 − P of the complement.
    pub fn complement(self) -> Self {
        if self.ln == f64::NEG_INFINITY {
            return Self::CERTAIN;
        }
        let odds = (-self.ln).exp_m1().recip();
        let ln = ln_one_minus_exp(-self.ln);
        let slopes = self.slopes.map(|slope| if slope == 0.0 { 0.0 } else { -odds * slope });
        Self { ln, slopes }
    }

    /// Returns the difference P − `part`, and the ratio of this difference to P. A small ratio indicates
    /// cancellation.
    pub fn without(self, part: Self) -> (Self, f64) {
        if part.ln == f64::NEG_INFINITY {
            return (self, 1.0);
        }
        let difference = self.ln - part.ln;
        let (ratio, share) = ((-difference).exp(), -(-difference).exp_m1());
        let slope = |i: usize| (self.slopes[i] - ratio * part.slopes[i]) / share;
        let ln = self.ln + ln_one_minus_exp(difference);
        (Self { ln, slopes: std::array::from_fn(slope) }, share)
    }
}

/// Both tail probabilities at a point x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LnTails<const N: usize> {
    /// P(X ≤ x).
    pub lower: LnProbability<N>,
    /// P(X > x).
    pub upper: LnProbability<N>,
}

impl<const N: usize> LnTails<N> {
    /// Tail probabilities at a point at or below the lower end of the support.
    pub const BELOW: Self =
        Self { lower: LnProbability::IMPOSSIBLE, upper: LnProbability::CERTAIN };
    /// Tail probabilities at a point at or above the upper end of the support.
    pub const ABOVE: Self =
        Self { lower: LnProbability::CERTAIN, upper: LnProbability::IMPOSSIBLE };
    pub(super) const UNDEFINED: Self =
        Self { lower: LnProbability::UNDEFINED, upper: LnProbability::UNDEFINED };

    /// Creates both tails from one tail probability; the other tail is its complement.
    pub(super) fn from_one(tail: Tail, mass: LnProbability<N>) -> Self {
        Self::new(tail, mass, mass.complement())
    }

    pub(super) fn new(tail: Tail, mass: LnProbability<N>, other: LnProbability<N>) -> Self {
        match tail {
            Tail::Lower => Self { lower: mass, upper: other },
            Tail::Upper => Self { lower: other, upper: mass },
        }
    }

    /// Returns the probability of the lower or the upper tail.
    pub fn tail(&self, tail: Tail) -> LnProbability<N> {
        match tail {
            Tail::Lower => self.lower,
            Tail::Upper => self.upper,
        }
    }

    /// Returns the probability of the interval between two points, computed from small tail probabilities if
    /// possible. Also returns a measure of cancellation: if the probability is the difference of two tail
    /// probabilities, the ratio of the difference to the larger tail probability.
    pub fn between(below: &Self, above: &Self) -> (LnProbability<N>, f64) {
        let half = -std::f64::consts::LN_2;
        let (outside_below, outside_above) = (below.lower, above.upper);
        if outside_below.ln > half {
            return below.upper.without(outside_above);
        }
        if outside_above.ln > half {
            return above.lower.without(outside_below);
        }
        let (p, q) = (outside_below.ln.exp(), outside_above.ln.exp());
        let inside = 1.0 - p - q;
        if inside <= 0.5 {
            return above.lower.without(outside_below);
        }
        let slope = |i: usize| {
            let moved = |mass: f64, slope: f64| if mass == 0.0 { 0.0 } else { mass * slope };
            let outside = moved(p, outside_below.slopes[i]) + moved(q, outside_above.slopes[i]);
            -outside / inside
        };
        (LnProbability { ln: (-(p + q)).ln_1p(), slopes: std::array::from_fn(slope) }, inside)
    }
}
