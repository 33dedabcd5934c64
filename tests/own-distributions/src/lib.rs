//! Three user-defined distributions, each with a log density, a draw and a domain: copy the file that is closest to
//! your distribution.
//!
//! - [`Laplace`]: a continuous distribution
//! - [`Geometric`]: a distribution of counts
//! - [`RandomWalk`]: a distribution of vectors

mod geometric;
mod laplace;
mod random_walk;

pub use geometric::Geometric;
pub use laplace::Laplace;
pub use random_walk::RandomWalk;
