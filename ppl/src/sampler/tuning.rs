//! What a sampler has learnt, and has still to learn, between two transitions.

use serde::{Deserialize, Serialize};

use super::{
    delayed::Screening, proposal::ProposalShape, report::InverseMassMatrix, warmup::Warmup,
};

/// All of a chain beside its position and its random stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Tuning {
    /// Of [`Nuts`](super::Nuts).
    Hamiltonian { step: f64, covariance: InverseMassMatrix, warmup: Warmup },
    /// Of [`Metropolis`](super::Metropolis).
    Walk(ProposalShape),
    /// Of [`DelayedAcceptance`](super::DelayedAcceptance).
    Screened(ProposalShape, Screening),
}

impl Tuning {
    /// Whether it is of a density of `dim` coordinates, after so many transitions of the warmup.
    pub(super) fn fits(&self, dim: usize, transitions: usize) -> bool {
        match self {
            Self::Hamiltonian { warmup, .. } => warmup.fits(dim, transitions),
            Self::Walk(shape) | Self::Screened(shape, _) => shape.fits(dim, transitions),
        }
    }
}
