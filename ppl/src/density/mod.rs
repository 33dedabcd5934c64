//! Log densities as samplers see them: value, gradient, rejected points, and the statements that reject them.

mod domain_error;
mod log_density;
mod rejection;
pub(crate) mod site;

pub use domain_error::DomainError;
pub use log_density::LogDensity;
pub use rejection::{FatalError, Location, OtherError, Rejection};
