//! Intervals of the real line, as `.truncate` and `.censor` take them.

use std::ops::{
    Bound, Range, RangeBounds, RangeFrom, RangeFull, RangeInclusive, RangeTo, RangeToInclusive,
};

use crate::density::DomainError;

/// A range of plain numbers.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no range of plain numbers",
    label = "needed: `0.0..`, `..1.0`, `0.0..1.0` or the like",
    note = "write `0.0..`, not `0..`; the ends are data, not unknowns",
    note = "of what lies above an unknown `a`: `factor(D.ln_density(&x) - D.ln_sf(a))`, and below with \
            `ln_cdf`; unknowns in ascending order: `.array::<N>().ordered()`"
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
    RangeToInclusive<f64>,
    (Bound<f64>, Bound<f64>)
);

/// An interval whose ends may be infinite.
///
/// Whether an end belongs to it matters for counts only: for real numbers it has measure zero,
/// and both count as inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    lower: f64,
    upper: f64,
    with_lower: bool,
    with_upper: bool,
}

impl Interval {
    /// From `a..b`, `a..=b`, `a..`, `..b` and the like.
    pub fn new(range: impl Ends) -> Self {
        let end = |bound: Bound<&f64>, open: f64| match bound {
            Bound::Included(&x) => (x, true),
            Bound::Excluded(&x) => (x, false),
            Bound::Unbounded => (open, true),
        };
        let (lower, with_lower) = end(range.start_bound(), f64::NEG_INFINITY);
        let (upper, with_upper) = end(range.end_bound(), f64::INFINITY);
        Self { lower, upper, with_lower, with_upper }
    }

    /// Lower end.
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// Upper end.
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// Whether the real number `x` lies in the closed interval.
    #[inline]
    pub fn contains(&self, x: f64) -> bool {
        (self.lower..=self.upper).contains(&x)
    }

    /// The first and the last count inside; the last is [`u64::MAX`] without an upper end, and
    /// below the first where there is none.
    pub fn counts(&self) -> (u64, u64) {
        let first = if self.with_lower { self.lower.ceil() } else { self.lower.floor() + 1.0 };
        let last = if self.with_upper { self.upper.floor() } else { self.upper.ceil() - 1.0 };
        // `as` saturates: −∞ is 0, ∞ the largest count
        if last < 0.0 { (1, 0) } else { (first as u64, last as u64) }
    }

    /// What two intervals have in common.
    pub(super) fn and(&self, other: &Self) -> Self {
        let (lower, with_lower) = if other.lower > self.lower {
            (other.lower, other.with_lower)
        } else {
            (self.lower, self.with_lower && (other.with_lower || other.lower < self.lower))
        };
        let (upper, with_upper) = if other.upper < self.upper {
            (other.upper, other.with_upper)
        } else {
            (self.upper, self.with_upper && (other.with_upper || other.upper > self.upper))
        };
        Self { lower, upper, with_lower, with_upper }
    }

    /// Demands ends in order.
    pub(super) fn validate(&self, variation: &str) -> Result<(), DomainError> {
        let both = self.with_lower && self.with_upper;
        let holds = self.lower < self.upper || (both && self.lower == self.upper);
        let requirement = format_args!("below the upper end {}", self.upper);
        DomainError::require(holds, variation, "lower end", requirement, self.lower)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_respect_open_ends() {
        assert_eq!(Interval::new(..).counts(), (0, u64::MAX));
        assert_eq!(Interval::new(1.0..5.0).counts(), (1, 4));
        assert_eq!(Interval::new(1.0..=5.0).counts(), (1, 5));
        assert_eq!(Interval::new(0.5..4.5).counts(), (1, 4));
        let open = (Bound::Excluded(1.0), Bound::Unbounded);
        assert_eq!(Interval::new(open).counts(), (2, u64::MAX));
        let (first, last) = Interval::new(..0.0).counts();
        assert!(first > last);
    }

    #[test]
    fn the_common_part_keeps_the_stricter_ends() {
        let part = Interval::new(1.0..5.0).and(&Interval::new(1.0..=5.0));
        assert_eq!(part, Interval::new(1.0..5.0));
        let part = Interval::new(2.0..).and(&Interval::new(..=3.0));
        assert_eq!(part, Interval::new(2.0..=3.0));
    }
}
