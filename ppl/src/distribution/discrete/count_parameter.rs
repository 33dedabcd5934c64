//! Parameters that are counts.

use crate::datum::Datum;

/// A parameter that is a count: `u64`, `u32`, `usize` or a reference to one.
pub trait CountParameter: Copy {
    /// Its value.
    fn count(self) -> u64;
}

impl<T: Copy + Datum<u64>> CountParameter for T {
    #[inline]
    fn count(self) -> u64 {
        self.lift()
    }
}
