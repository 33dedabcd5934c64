//! Markov chain Monte Carlo: [`Nuts`], which uses gradients, and the gradient-free samplers [`Metropolis`] and
//! [`DelayedAcceptance`].

mod draws;
mod hamiltonian;
mod run;
mod walk;

pub use draws::chains::{Chain, Chains};
pub use draws::report::{
    Divergence, DrawStats, InverseMassMatrix, MapKind, MapSwitch, WarmupReport,
};
pub use draws::store::ChainsFileError;
pub use hamiltonian::nuts::{NoUTurn, Nuts};
pub use run::error::RunError;
pub use run::kernel::{ChainState, Kernel, Step, UserKernel};
pub use run::mcmc::Mcmc;
pub(crate) use run::mcmc::OneDensity;
pub use run::progress::{ChainStatus, Progress};
pub use run::stop::StopReason;
pub use walk::delayed::{DelayedAcceptance, Screened};
pub use walk::metropolis::{Metropolis, RandomWalk};
