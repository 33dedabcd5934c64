//! Several ranks that solve one problem: messages between ranks, and the partition of the mesh.
//!
//! Every rank computes the elements of its part. *Vectors* of nodal values are complete: a shared node has
//! the same value on all ranks, bit for bit. Nodal sums over the elements of one rank are *partial* until
//! [`Halo::complete`] has added the sums of all ranks. Therefore, only sums over elements or nodes need
//! communication; operations on single nodes do not.

mod bisection;
mod communicator;
mod halo;
mod part;
mod ranks;
mod threads;

pub use communicator::{Communicator, RankLost};
pub use ranks::Ranks;

pub(crate) use bisection::bisect;
pub(crate) use communicator::guarded;
pub(crate) use halo::Halo;
pub(crate) use part::Part;

#[cfg(test)]
#[path = "../../tests/unit/parallel.rs"]
mod tests;
