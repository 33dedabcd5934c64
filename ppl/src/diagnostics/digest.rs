//! What a table says of one number.

use super::order::{Scores, ascending, quantile_of_sorted};
use super::ranked::Ranked;
use super::{ess, mean_and_variance, rhat};

/// What a table says of one number.
pub(crate) struct Digest {
    pub(crate) mean: f64,
    pub(crate) sd: f64,
    /// The 5 %, 50 % and 95 % quantiles.
    pub(crate) quantiles: [f64; 3],
    pub(crate) rhat: f64,
    pub(crate) ess_bulk: f64,
    pub(crate) ess_tail: f64,
    pub(crate) mcse_mean: f64,
}

impl Digest {
    /// Of one number, with a table of scores for the draws in its halves.
    pub(crate) fn new(chains: &[&[f64]], table: &Scores) -> Self {
        let (mean, variance) = mean_and_variance(chains.iter().copied().flatten().copied());
        let ranked = Ranked::new(chains, Some(table));
        let Some(ranked) = ranked else {
            let order = ascending(chains.iter().copied().flatten().copied());
            let sorted: Vec<f64> = order.into_iter().map(|(x, _)| x).collect();
            let quantiles = [0.05, 0.5, 0.95].map(|p| quantile_of_sorted(&sorted, p));
            let none = f64::NAN;
            return Self {
                mean,
                sd: variance.sqrt(),
                quantiles,
                rhat: none,
                ess_bulk: none,
                ess_tail: none,
                mcse_mean: none,
            };
        };
        Self {
            mean,
            sd: variance.sqrt(),
            quantiles: [0.05, 0.5, 0.95].map(|p| ranked.quantile(p)),
            rhat: rhat::of_ranked(&ranked),
            ess_bulk: ess::bulk(&ranked),
            ess_tail: ess::tail(&ranked),
            mcse_mean: (variance / ess::ess_mean(chains)).sqrt(),
        }
    }
}
