//! Markov chain Monte Carlo: [`Nuts`], which uses gradients, and the gradient-free samplers [`Metropolis`] and
//! [`DelayedAcceptance`].
//!
//! A module imports only from modules above it in this list:
//! 1. `reports`: statistics of draws and of the warmup, the reason why a chain stopped
//! 2. `control`: settings of a run, progress, random streams, rejected points, errors
//! 3. `hamiltonian`: metrics, trajectories, step size, warmup of NUTS
//! 4. `adaptation`: proposals of random walks, screening, the adapted state of every sampler
//! 5. `draws`: chains and their file
//! 6. `run`: runs and resumed runs of any kernel
//! 7. `nuts`, `walk`: the samplers

mod adaptation;
mod control;
mod draws;
mod hamiltonian;
mod nuts;
mod reports;
mod run;
mod walk;

pub use control::error::RunError;
pub use control::progress::{ChainStatus, Progress};
pub use draws::chains::{Chain, Chains};
pub use draws::store::ChainsFileError;
pub use nuts::{NoUTurn, Nuts};
pub use reports::report::{
    Divergence, DrawStats, InverseMassMatrix, MapKind, MapSwitch, WarmupReport,
};
pub use reports::stop::StopReason;
pub use run::kernel::{ChainState, Kernel, Step, UserKernel};
pub use run::mcmc::Mcmc;
pub(crate) use run::mcmc::OneDensity;
pub use walk::delayed::{DelayedAcceptance, Screened};
pub use walk::metropolis::{Metropolis, RandomWalk};
