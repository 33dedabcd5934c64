//! State of the adaptation between two transitions.

use serde::{Deserialize, Serialize};

use crate::sampler::draws::report::InverseMassMatrix;
use crate::sampler::hamiltonian::warmup::Warmup;
use crate::sampler::walk::proposal::ProposalShape;
use crate::sampler::walk::screening::Screening;

/// State of a chain except its position and its random stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Tuning {
    /// State of a chain of [`Nuts`](crate::Nuts).
    Hamiltonian { step: f64, covariance: InverseMassMatrix, warmup: Warmup },
    /// State of a chain of [`Metropolis`](crate::Metropolis).
    Walk(ProposalShape),
    /// State of a chain of [`DelayedAcceptance`](crate::DelayedAcceptance).
    Screened(ProposalShape, Screening),
    /// State of a chain with a user-defined kernel. This state is not stored.
    UserDefined,
}

impl Tuning {
    /// Whether the state is a state of a chain with `dim` coordinates after `transitions` warmup transitions.
    pub(crate) fn fits(&self, dim: usize, transitions: usize) -> bool {
        match self {
            Self::Hamiltonian { warmup, .. } => warmup.fits(dim, transitions),
            Self::Walk(shape) | Self::Screened(shape, _) => shape.fits(dim, transitions),
            Self::UserDefined => true,
        }
    }
}
