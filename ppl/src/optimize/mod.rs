//! Mode search and approximation at the mode: [`Map`] and [`Laplace`].

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
