//! Prony series of a relaxation test or a dynamic test (DMA).
//!
//! The modules, in the order of their layers:
//!
//! 1. `series`: a Prony series, its moduli and its lines in a case
//! 2. `data`: measured moduli, read from a table
//! 3. `nonnegative`: least squares with unknowns that are not negative
//! 4. `fit`: the fit of a series, and the choice of the number of terms
//! 5. `quality`: data that no series describes, and fits with a large error
//! 6. `picture`: the figure of a fit

mod data;
mod fit;
mod nonnegative;
mod picture;
mod quality;
mod series;
#[cfg(test)]
mod tests;

pub use data::MeasuredModuli;
pub use fit::PronyFit;
pub use picture::prony_picture;
pub use quality::check_fit;
pub use series::{PronySeries, PronyTerm};
