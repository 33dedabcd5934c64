//! Modes and what lies round them: [`Map`] and [`Laplace`].

mod approach;
mod curvature;
mod error;
mod laplace;
mod line_search;
mod map;
mod rescaled;

pub(crate) use approach::approach;
pub use error::OptimizeError;
pub use laplace::Laplace;
pub use map::{Map, Mode};
