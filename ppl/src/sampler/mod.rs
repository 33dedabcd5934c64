//! Markov chain Monte Carlo: [`Nuts`], and without gradients [`Metropolis`] and
//! [`DelayedAcceptance`].

mod chains;
mod delayed;
mod earlier;
mod error;
mod hamiltonian;
mod metric;
mod metropolis;
mod nuts;
mod progress;
mod random_walk;
mod rejections;
mod run;
mod settings;
mod step_size;
mod store;
mod trajectory;
mod tuning;
mod warmup;

pub use chains::{
    Chain, Chains, Covariance, Divergence, DrawStats, MapKind, MapSwitch, WarmupReport,
};
pub use delayed::DelayedAcceptance;
pub use error::SampleError;
pub use metropolis::Metropolis;
pub use nuts::Nuts;
pub use progress::{ChainStatus, Progress};
pub use store::ChainsFileError;
