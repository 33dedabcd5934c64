//! The calibration on which validations are based.

use super::super::fitted::Fitted;
use super::super::posterior_draws::Draw;

/// Posterior of the calibration with its surrogate.
pub(super) struct Calibrated {
    /// Names of the parameters.
    pub(super) names: Vec<String>,
    pub(super) draws: Vec<Draw>,
    pub(super) fitted: Fitted,
}

impl Calibrated {
    /// Returns `n` draws, evenly spaced over all chains; all draws if there are fewer.
    pub(super) fn thinned(&self, n: usize) -> Vec<&Draw> {
        let draws = &self.draws;
        let n = n.min(draws.len());
        (0..n).map(|k| &draws[(2 * k + 1) * draws.len() / (2 * n)]).collect()
    }
}
