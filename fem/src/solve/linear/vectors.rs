//! Vector operations of the linear solvers, for vectors in the memory of this process or of a device.

use std::borrow::BorrowMut;
use std::fmt::Debug;

/// Operations on the vectors of one multigrid level. A vector has a fixed number of values for each local node.
pub(crate) trait Vectors: Clone + Debug {
    /// Borrowed vector.
    type Vector: ?Sized;
    /// Owned vector.
    type Owned: BorrowMut<Self::Vector> + Debug;

    /// Returns a vector of zeros with the length of `like`.
    fn zero(&self, like: &Self::Vector) -> Self::Owned;

    /// x ← 0.
    fn clear(&self, x: &mut Self::Vector);

    /// y ← x.
    fn copy(&self, x: &Self::Vector, y: &mut Self::Vector);
}

/// Additional operations of Lanczos' iteration.
pub(crate) trait LanczosVectors: Vectors {
    /// Sets x_i to value(i), where i numbers the values of the local nodes. Ghosts get the values of their
    /// owners.
    fn fill(&self, x: &mut Self::Vector, value: impl Fn(usize) -> f64 + Sync);

    /// x ← a x.
    fn scale(&self, x: &mut Self::Vector, a: f64);

    /// Inner product Σ a b.
    fn dot(&self, a: &Self::Vector, b: &Self::Vector) -> f64;

    /// Computes the next vector y ← −w − a d − b y of Lanczos' iteration.
    fn recur(&self, y: &mut Self::Vector, w: &Self::Vector, a: f64, d: &Self::Vector, b: f64);
}

/// Additional operations of Krylov methods.
pub(crate) trait KrylovVectors: LanczosVectors {
    /// Returns Σ w a b, the inner product with a diagonal weight.
    fn weighted_dot(&self, w: &Self::Vector, a: &Self::Vector, b: &Self::Vector) -> f64;

    /// y ← y + a x.
    fn add_scaled(&self, y: &mut Self::Vector, a: f64, x: &Self::Vector);

    /// y ← x + a y.
    fn scale_and_add(&self, y: &mut Self::Vector, a: f64, x: &Self::Vector);

    /// Type of a vector that is stored for later sums. A stored vector may have less precision than
    /// [`Vectors::Vector`].
    type Stored;

    /// Stores x.
    fn store(&self, x: &Self::Vector, precision: Precision) -> Self::Stored;

    /// Returns Σ w a b, the inner product with a diagonal weight w and a stored vector a.
    fn weighted_dot_stored(&self, w: &Self::Vector, a: &Self::Stored, b: &Self::Vector) -> f64;

    /// Computes y ← y + a x for a stored vector x.
    fn add_stored(&self, y: &mut Self::Vector, a: f64, x: &Self::Stored);
}

/// Lowest acceptable precision of a stored vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    /// Seven decimal digits.
    Single,
    Double,
}
