//! The potential scale reduction R̂.

use super::ranked::Ranked;
use super::{mean, mean_and_variance, split, usable};

/// Rank-normalised split R̂: the larger of the bulk and the folded version.
///
/// Chains are split in half and ranks over all draws become normal scores z. With W the mean of
/// the variances within the halves and B/n the variance between their means,
/// R̂ = √((B/W + n − 1)/n). The folded version applies the same to |x − median|, so that chains
/// which differ in spread are seen too. Above 1.01 the chains do not agree yet.
///
/// One slice per chain; chains are cut to the shortest. NaN for fewer than four draws, for values
/// that are not finite, and for a quantity that never moved.
///
/// ```
/// let here: Vec<f64> = (0..100).map(|i| (i as f64).sin()).collect();
/// let there: Vec<f64> = here.iter().map(|x| x + 5.0).collect();
/// assert!(ppl::diagnostics::rhat(&[&here, &there]) > 1.5);
/// ```
///
/// Reference: Vehtari et al. (2021), equations 1–4 and 14, doi:10.1214/20-BA1221.
pub fn rhat(chains: &[&[f64]]) -> f64 {
    Ranked::new(chains, None).map_or(f64::NAN, |ranked| of_ranked(&ranked))
}

pub(super) fn of_ranked(ranked: &Ranked) -> f64 {
    let bulk = basic(&ranked.halves(&ranked.scores));
    let folded = basic(&ranked.halves(&ranked.folded_scores()));
    bulk.max(folded) // a folded constant (±1 only) is NaN and gives way
}

/// Split R̂ of Gelman and Rubin on the draws themselves: no ranks, no folding.
///
/// What older programs report; it needs a finite variance and does not see chains that differ in
/// spread. Prefer [`rhat`].
///
/// Reference: Gelman et al. (2013), *Bayesian Data Analysis*, section 11.4.
pub fn rhat_basic(chains: &[&[f64]]) -> f64 {
    usable(chains).map_or(f64::NAN, |chains| basic(&split(&chains)))
}

fn basic(chains: &[&[f64]]) -> f64 {
    let n = chains[0].len() as f64;
    let moments: Vec<(f64, f64)> =
        chains.iter().map(|chain| mean_and_variance(chain.iter().copied())).collect();
    let within = mean(moments.iter().map(|m| m.1));
    let between = n * mean_and_variance(moments.iter().map(|m| m.0)).1;
    ((between / within + n - 1.0) / n).sqrt()
}
