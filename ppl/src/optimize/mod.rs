//! Modes and what lies round them: [`Map`] and [`Laplace`].

mod approach;
mod curvature;
mod laplace;
mod line_search;
mod map;

pub(crate) use approach::approach;
pub use laplace::Laplace;
pub use map::{Map, Mode, OptimizeError};
