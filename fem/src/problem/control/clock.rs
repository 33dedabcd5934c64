//! Comparison of positions on the clock of a run, which are fractions of its duration.

/// Largest difference between two positions that count as equal. This difference is far below the shortest segment of a
/// load program (1e-9), and far above rounding errors.
pub(crate) const SAME: f64 = 1e-12;

/// Whether `position` is later than `other` by more than a rounding error.
pub(crate) fn is_later(position: f64, other: f64) -> bool {
    position > other + SAME
}
