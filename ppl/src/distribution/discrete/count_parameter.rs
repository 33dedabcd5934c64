//! Parameters of distributions that are counts.

use crate::quantity::datum::Datum;

/// A distribution parameter that is a count: `u64`, `u32`, `usize` or a reference to one of these types.
pub trait CountParameter: Copy {
    /// Value of the count.
    fn count(self) -> u64;
}

impl<T: Copy + Datum<u64>> CountParameter for T {
    #[inline]
    fn count(self) -> u64 {
        self.lift()
    }
}
