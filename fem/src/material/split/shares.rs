//! Terms of Hencky's energy that a split degrades.

/// For each term of Hencky's energy, one if damage degrades the term and the term drives damage, else zero.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Shares<T> {
    /// 1 if damage degrades the volumetric term, which is proportional to (tr ε)², else 0.
    pub(in crate::material) volume: T,
    /// 1 if damage degrades the term of a principal strain, else 0; by strain.
    pub(in crate::material) principal: [T; 3],
}
