//! Ranks that share one problem: messages between them, and who has which part of the mesh.
//!
//! Every rank works on the elements of its part. A *vector* of nodal values is whole: a node that
//! several ranks have has the same value on each of them, bit for bit. What the elements of one rank
//! give is *partial* until [`Halo::complete`] has added it up. So only sums over elements and over nodes
//! know of ranks, and whatever acts node by node does not.

mod bisection;
mod communicator;
mod halo;
mod part;
mod ranks;
mod threads;

pub use communicator::Communicator;
pub use ranks::Ranks;

pub(crate) use bisection::bisect;
pub(crate) use communicator::{RankLost, guarded};
pub(crate) use halo::Halo;
pub(crate) use part::Part;

#[cfg(test)]
#[path = "../../tests/unit/parallel.rs"]
mod tests;
