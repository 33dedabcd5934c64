//! The report: figures and one self-contained HTML page, from plain results.

mod figures;
mod mesh_picture;
mod page;
mod results;
mod style;

pub use mesh_picture::mesh_picture;
pub(crate) use page::{number, page};
pub(crate) use results::{CalibratedParameter, OrderErrors, Points, Qoi, Results, mean};
