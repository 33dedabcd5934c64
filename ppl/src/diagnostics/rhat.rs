//! Potential scale reduction factor R̂.

use super::order::{normal_scores, quantile};
use super::{borrow, mean, mean_and_variance, split, usable};

/// Rank-normalised split R̂: the larger of bulk R̂ and folded R̂.
///
/// Each chain is split in half, and the draws are replaced by the normal scores z of their ranks. Let n be the length
/// of a half, W the mean of the variances within the halves, and B/n the variance between the means of the halves.
/// Then R̂ = √((B/W + n − 1)/n). Folded R̂ is computed from |x − median|, so that it detects chains with different
/// spread. If R̂ is above 1.01, the chains have not converged.
///
/// `chains` has one slice per chain; longer chains are cut to the length of the shortest. NaN for fewer than four
/// draws, for values that are not finite, and for a constant quantity.
///
/// ```
/// let here: Vec<f64> = (0..100).map(|i| (i as f64).sin()).collect();
/// let there: Vec<f64> = here.iter().map(|x| x + 5.0).collect();
/// assert!(ppl::diagnostics::rhat(&[&here, &there]) > 1.5);
/// ```
///
/// Reference: Vehtari et al. (2021), equations 1–4 and 14, doi:10.1214/20-BA1221.
pub fn rhat(chains: &[&[f64]]) -> f64 {
    let Some(chains) = usable(chains) else {
        return f64::NAN;
    };
    let halves = split(&chains);
    let median = quantile(&halves.concat(), 0.5);
    let distances = halves.iter().map(|half| half.iter().map(|x| (x - median).abs()).collect());
    let distances: Vec<Vec<f64>> = distances.collect();
    let bulk = variance_ratio(&borrow(&normal_scores(&halves)));
    let folded = variance_ratio(&borrow(&normal_scores(&borrow(&distances))));
    bulk.max(folded) // folded R̂ is NaN if |x − median| is constant; `max` ignores NaN
}

/// Computes R̂ = √((B/W + n − 1)/n) of chains of length n, without splitting and ranking. W is the mean of the
/// variances within the chains, and B/n is the variance between the means of the chains.
fn variance_ratio(chains: &[&[f64]]) -> f64 {
    let n = chains[0].len() as f64;
    let moments: Vec<(f64, f64)> =
        chains.iter().map(|chain| mean_and_variance(chain.iter().copied())).collect();
    let within = mean(moments.iter().map(|m| m.1));
    let between = n * mean_and_variance(moments.iter().map(|m| m.0)).1;
    ((between / within + n - 1.0) / n).sqrt()
}
