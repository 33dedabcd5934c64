//! Gaussian processes, for example for the discrepancy between a simulation and measurements.

mod correlations;
mod covariance;
mod matrix;
mod process;

pub use covariance::{
    Covariance, CovarianceParameters, LengthNumbers, Lengths, Matern32, Matern52, PerColumn,
    SquaredExponential,
};
pub use process::GaussianProcess;
