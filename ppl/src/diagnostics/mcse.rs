//! Monte Carlo standard errors: the part of an estimate's error that is due to the finite number of draws.

use super::{ess_mean, ess_quantile, ess_sd, mean, mean_and_variance, usable};
use crate::number::scalar::logistic;
use crate::special::{Tail, beta_logit_quantile};

/// Monte Carlo standard error of the posterior mean, sd/√ESS, in the unit of the draws.
///
/// `chains` has one slice per chain. NaN if the effective sample size is NaN.
///
/// ```
/// let chain: Vec<f64> = (0..1000).map(|i| (i as f64 * 2.4).sin()).collect();
/// assert!(ppl::diagnostics::mcse_mean(&[&chain]) < 0.03);
/// ```
///
/// Reference: Vehtari et al. (2021), section 4.4, doi:10.1214/20-BA1221.
pub fn mcse_mean(chains: &[&[f64]]) -> f64 {
    let Some(chains) = usable(chains) else {
        return f64::NAN;
    };
    let (_, variance) = mean_and_variance(chains.iter().copied().flatten().copied());
    (variance / ess_mean(&chains)).sqrt()
}

/// Monte Carlo standard error of the posterior standard deviation, from the fourth moment: √((E\[(x−x̄)⁴\] − σ⁴)/ESS) /
/// (2σ), with the effective sample size of (x − x̄)².
///
/// `chains` has one slice per chain. NaN if the effective sample size is NaN.
pub fn mcse_sd(chains: &[&[f64]]) -> f64 {
    let Some(chains) = usable(chains) else {
        return f64::NAN;
    };
    let all = || chains.iter().copied().flatten().copied();
    let centre = mean(all());
    let second = mean(all().map(|x| (x - centre).powi(2)));
    let fourth = mean(all().map(|x| (x - centre).powi(4)));
    ((fourth - second * second) / ess_sd(&chains)).sqrt() / (2.0 * second.sqrt())
}

/// Monte Carlo standard error of a posterior quantile: half the distance between two order statistics. The ranks of
/// the two order statistics, relative to the number of draws, are the bounds of the central 68 % interval of the
/// distribution Beta(ESS·p + 1, ESS·(1 − p) + 1), where p is `probability`.
///
/// `chains` has one slice per chain, `probability` is in (0, 1). NaN if the effective sample size is NaN.
///
/// Reference: Vehtari et al. (2021), section 4.4.
pub fn mcse_quantile(chains: &[&[f64]], probability: f64) -> f64 {
    let Some(chains) = usable(chains) else {
        return f64::NAN;
    };
    let ess = ess_quantile(&chains, probability);
    if ess.is_nan() {
        return f64::NAN;
    }
    let mut sorted = chains.concat();
    sorted.sort_unstable_by(f64::total_cmp);
    let (a, b) = (ess * probability + 1.0, ess * (1.0 - probability) + 1.0);
    let position = |p: f64| {
        let fraction = logistic(beta_logit_quantile(a, b, p, Tail::Lower)).0;
        fraction * sorted.len() as f64 - 1.0
    };
    // the probabilities Φ(−1) and Φ(1), one standard deviation of a normal on either side
    let low = position(0.1586553).max(0.0).floor() as usize;
    let high = position(0.8413447).min(sorted.len() as f64 - 1.0).ceil() as usize;
    (sorted[high] - sorted[low]) / 2.0
}
