//! State of the adaptation between two transitions.

use serde::{Deserialize, Serialize};

use super::{
    proposal::ProposalShape, report::InverseMassMatrix, screening::Screening, warmup::Warmup,
};

/// State of a chain except its position and its random stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Tuning {
    /// State of [`Nuts`](super::Nuts).
    Hamiltonian { step: f64, covariance: InverseMassMatrix, warmup: Warmup },
    /// State of [`Metropolis`](super::Metropolis).
    Walk(ProposalShape),
    /// State of [`DelayedAcceptance`](super::DelayedAcceptance).
    Screened(ProposalShape, Screening),
}

impl Tuning {
    /// Whether the state is a state of a chain with `dim` coordinates after `transitions` warmup transitions.
    pub(super) fn fits(&self, dim: usize, transitions: usize) -> bool {
        match self {
            Self::Hamiltonian { warmup, .. } => warmup.fits(dim, transitions),
            Self::Walk(shape) | Self::Screened(shape, _) => shape.fits(dim, transitions),
        }
    }
}
