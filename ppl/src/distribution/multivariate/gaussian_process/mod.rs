//! Gaussian processes: functions as unknowns.

mod covariance;
mod kernel;
mod prediction;
mod process;

pub use kernel::{Kernel, Lengths, Matern32, Matern52, Point, SquaredExponential};
pub use prediction::Prediction;
pub use process::{GaussianProcess, Mean};
