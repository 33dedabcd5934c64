//! Monte Carlo samplers: [`Nuts`], the family of Metropolis, and [`Smc`].

mod archive;
mod chains;
mod componentwise;
mod delayed;
mod differential;
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
mod smc;
mod step_size;
mod store;
mod trajectory;
mod tuning;
mod warmup;

pub use chains::{
    Chain, Chains, Covariance, Divergence, DrawStats, MapKind, MapSwitch, WarmupReport,
};
pub use componentwise::ComponentwiseMetropolis;
pub use delayed::DelayedAcceptance;
pub use differential::DifferentialEvolution;
pub use error::SampleError;
pub use metropolis::Metropolis;
pub use nuts::Nuts;
pub use progress::{ChainStatus, Progress};
pub use smc::{Evidence, Smc, Stage, TemperedDraws};
pub use store::ChainsFileError;
