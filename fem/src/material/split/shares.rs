//! Terms of Hencky's energy that a split degrades.

/// For each term of Hencky's energy, one if damage degrades the term and the term drives damage, else zero.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Shares<T> {
    /// Share of the term (tr ε)².
    pub(in crate::material) volume: T,
    /// Share of the term of each principal strain.
    pub(in crate::material) principal: [T; 3],
}
