//! Markov chain samplers: [`Nuts`] and [`Metropolis`].

mod chains;
mod error;
mod hamiltonian;
mod metric;
mod metropolis;
mod nuts;
mod progress;
mod rejections;
mod run;
mod settings;
mod step_size;
mod trajectory;
mod warmup;

pub use chains::{Chain, Chains, Covariance, Divergence, DrawStats, WarmupReport};
pub use error::SampleError;
pub use metropolis::Metropolis;
pub use nuts::Nuts;
pub use progress::{ChainStatus, Progress};
