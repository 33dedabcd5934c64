//! The terms of Hencky's energy that a split degrades.

/// Shares of the terms of Hencky's energy that damage degrades and that drive damage: one or zero.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Shares<T> {
    /// Share of the term in tr ε.
    pub(in crate::material) volume: T,
    /// Share of the term of each principal strain.
    pub(in crate::material) principal: [T; 3],
}
