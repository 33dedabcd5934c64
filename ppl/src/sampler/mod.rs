//! Markov chain Monte Carlo: [`Nuts`], which uses gradients, and the gradient-free samplers [`Metropolis`] and
//! [`DelayedAcceptance`].

mod chains;
mod delayed;
mod dot;
mod encoding;
mod error;
mod hamiltonian;
mod mcmc;
mod metric;
mod metropolis;
mod nuts;
mod progress;
mod proposal;
mod rejections;
mod report;
mod resume;
mod run;
mod screening;
mod settings;
mod step_size;
mod stop;
mod store;
mod stream;
mod trajectory;
mod tuning;
mod warmup;

pub use chains::{Chain, Chains};
pub use delayed::{DelayedAcceptance, Screened};
pub use error::RunError;
pub use mcmc::Mcmc;
pub(crate) use mcmc::OneDensity;
pub use metropolis::{Metropolis, RandomWalk};
pub use nuts::{NoUTurn, Nuts};
pub use progress::{ChainStatus, Progress};
pub use report::{Divergence, DrawStats, InverseMassMatrix, MapKind, MapSwitch, WarmupReport};
pub use stop::StopReason;
pub use store::ChainsFileError;
