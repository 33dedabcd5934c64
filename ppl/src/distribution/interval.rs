//! Intervals of the real line, the arguments of `.truncate` and `.censor`.

use std::ops::{
    Bound, Range, RangeBounds, RangeFrom, RangeFull, RangeInclusive, RangeTo, RangeToInclusive,
};

use crate::density::DomainError;

/// A range of `f64` numbers, such as `0.0..` or `0.0..1.0`: the argument of `.truncate` and `.censor`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a range of plain numbers",
    label = "expected a range such as `0.0..`, `..1.0` or `0.0..1.0`",
    note = "write `0.0..`, not `0..`; the ends are data, not unknowns",
    note = "for values above an unknown limit `a`, write `factor(D.ln_density(&x) - D.ln_sf(a))`; for values \
            below `a`, use `ln_cdf`; for unknowns in ascending order, write `.array::<N>().ordered()`"
)]
pub trait Ends: RangeBounds<f64> {}

macro_rules! impl_ends {
    ($($Range:ty),*) => {
        $(impl Ends for $Range {})*
    };
}
impl_ends!(
    Range<f64>,
    RangeFrom<f64>,
    RangeFull,
    RangeInclusive<f64>,
    RangeTo<f64>,
    RangeToInclusive<f64>
);

/// An interval whose ends can be infinite. Both ends belong to the interval; this makes no difference to
/// probabilities, because a point has probability zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    lower: f64,
    upper: f64,
}

impl Interval {
    /// Interval from a range such as `a..b`, `a..=b`, `a..` or `..b`.
    pub fn new(range: impl Ends) -> Self {
        let end = |bound: Bound<&f64>, unbounded: f64| match bound {
            Bound::Included(&x) | Bound::Excluded(&x) => x,
            Bound::Unbounded => unbounded,
        };
        let lower = end(range.start_bound(), f64::NEG_INFINITY);
        let upper = end(range.end_bound(), f64::INFINITY);
        Self { lower, upper }
    }

    /// Lower end.
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// Upper end.
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// Intersection of two intervals.
    pub(super) fn and(self, other: Self) -> Self {
        Self { lower: self.lower.max(other.lower), upper: self.upper.min(other.upper) }
    }

    /// Checks that the lower end is below the upper end.
    pub(super) fn validate(self, variation: &'static str) -> Result<(), DomainError> {
        let requirement = format_args!("below the upper end {}", self.upper);
        DomainError::require(
            self.lower < self.upper,
            variation,
            "lower end",
            requirement,
            self.lower,
        )
    }
}
