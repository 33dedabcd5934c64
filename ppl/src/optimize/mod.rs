//! Modes and what lies round them: [`Map`], [`Laplace`] and [`Pathfinder`].

mod approach;
mod curvature;
mod laplace;
mod line_search;
mod map;
mod pathfinder;

pub(crate) use approach::approach;
pub use laplace::Laplace;
pub use map::{Map, Mode, OptimizeError};
pub(crate) use pathfinder::is_reliable;
pub use pathfinder::{Pathfinder, PathfinderFit, PathfinderPath};
