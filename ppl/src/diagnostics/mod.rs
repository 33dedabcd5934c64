//! Convergence diagnostics, Monte Carlo errors, and comparisons of prior and posterior.
//!
//! Every function takes plain slices, one per chain, and can be used without a model. The convergence diagnostics
//! follow Vehtari, Gelman, Simpson, Carpenter & Bürkner (2021), doi:10.1214/20-BA1221. The results agree with ArviZ
//! and the R package posterior to rounding (see the golden tests), with one deliberate difference: a quantity that is
//! constant or not finite gives NaN instead of an apparently good value.

mod autocovariance;
mod combinations;
mod energy;
mod ess;
mod identifiability;
mod loo;
mod loo_compare;
mod mcse;
mod modes;
mod order;
mod power_scaling;
mod rhat;

pub use energy::e_bfmi;
pub use ess::{ess_bulk, ess_mean, ess_quantile, ess_sd, ess_tail};
pub use identifiability::{Identifiability, Identification};
pub use loo::{Loo, LooError, LooPoint, pareto_smooth};
pub use loo_compare::{LooComparison, LooRow, loo_compare};
pub use mcse::{mcse_mean, mcse_quantile, mcse_sd};
pub use modes::Modes;
pub use order::quantile;
pub use rhat::rhat;

pub(crate) use combinations::{BeforeAndAfter, Combination, MOST_COMBINED, combinations};
pub(crate) use power_scaling::{PowerScaled, power_scaled};

/// Mean of the values; NaN if there are no values.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x));
    sum / n
}

/// Mean and sample variance (divisor n − 1), in two passes.
pub(crate) fn mean_and_variance<I>(values: I) -> (f64, f64)
where
    I: Iterator<Item = f64> + Clone,
{
    let centre = mean(values.clone());
    let (n, squares) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + (x - centre).powi(2)));
    (centre, squares / (n - 1.0))
}

/// Returns the chains, cut to the length of the shortest chain; `None` if diagnostics are undefined: fewer than four
/// draws, a value that is not finite, or a constant quantity.
fn usable<'a>(chains: &[&'a [f64]]) -> Option<Vec<&'a [f64]>> {
    let draws = chains.iter().map(|chain| chain.len()).min()?;
    let cut: Vec<&[f64]> = chains.iter().map(|chain| &chain[..draws]).collect();
    let first = *cut[0].first()?;
    let finite = cut.iter().all(|chain| chain.iter().all(|x| x.is_finite()));
    let moves = cut.iter().any(|chain| chain.iter().any(|&x| x != first));
    (draws >= 4 && finite && moves).then_some(cut)
}

/// Splits each chain into its first and its last half; the middle draw of a chain of odd length is omitted.
fn split<'a>(chains: &[&'a [f64]]) -> Vec<&'a [f64]> {
    chains
        .iter()
        .flat_map(|chain| {
            let half = chain.len() / 2;
            [&chain[..half], &chain[chain.len() - half..]]
        })
        .collect()
}

/// Returns slices that borrow the given chains.
fn borrow(chains: &[Vec<f64>]) -> Vec<&[f64]> {
    chains.iter().map(Vec::as_slice).collect()
}
