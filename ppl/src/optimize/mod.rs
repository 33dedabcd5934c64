//! Modes and their neighbourhood: [`Map`] and [`Laplace`].

mod curvature;
mod laplace;
mod line_search;
mod map;

pub use laplace::Laplace;
pub use map::{Map, Mode, OptimizeError};
