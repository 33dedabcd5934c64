//! The report: figures and one self-contained HTML page, from the files of the stages.

mod figures;
mod mesh_picture;
mod page;
mod results;
mod style;

pub use mesh_picture::mesh_picture;
pub use results::{Curve, Order, Parameter, Qoi, Results};

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The whole page as HTML.
pub fn render(results: &Results) -> String {
    page::page(results)
}
