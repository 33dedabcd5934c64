//! Effective sample size.

use super::autocovariance::autocovariance;
use super::order::{normal_scores, quantile};
use super::{borrow, mean, mean_and_variance, split, usable};

/// Bulk effective sample size, for the centre of the distribution: the effective sample size of the rank-normalised
/// split chains. At least 100 per chain is recommended.
///
/// `chains` has one slice per chain; longer chains are cut to the length of the shortest. NaN for fewer than four
/// draws, for values that are not finite, and for a constant quantity.
///
/// Reference: Vehtari et al. (2021), section 4.1, doi:10.1214/20-BA1221.
pub fn ess_bulk(chains: &[&[f64]]) -> f64 {
    let scores = |chains: Vec<&[f64]>| effective_size(&borrow(&normal_scores(&split(&chains))));
    usable(chains).map_or(f64::NAN, scores)
}

/// Tail effective sample size: the smaller of the effective sample sizes of the 5 % and the 95 % quantile.
///
/// The input is as for [`ess_bulk`], and the result is NaN in the same cases. (ArviZ 1 uses different quantiles by
/// default; for a comparison, call ArviZ with `prob=(0.05, 0.95)`.) Reference: Vehtari et al. (2021), section 4.3.
pub fn ess_tail(chains: &[&[f64]]) -> f64 {
    ess_quantile(chains, 0.05).min(ess_quantile(chains, 0.95))
}

/// Effective sample size for the mean: the effective sample size of the split chains without rank normalisation.
pub fn ess_mean(chains: &[&[f64]]) -> f64 {
    usable(chains).map_or(f64::NAN, |chains| effective_size(&split(&chains)))
}

/// Effective sample size for the standard deviation: the effective sample size of (x − x̄)².
pub fn ess_sd(chains: &[&[f64]]) -> f64 {
    let Some(chains) = usable(chains) else {
        return f64::NAN;
    };
    let centre = mean(chains.iter().copied().flatten().copied());
    of_transformed(&chains, |x| (x - centre).powi(2))
}

/// Effective sample size for a quantile: the effective sample size of the indicator x ≤ q, where q is the sample
/// quantile.
///
/// `probability` is in (0, 1). NaN as for [`ess_bulk`], and if the indicator is constant.
pub fn ess_quantile(chains: &[&[f64]], probability: f64) -> f64 {
    let Some(chains) = usable(chains) else {
        return f64::NAN;
    };
    let q = quantile(&chains.concat(), probability);
    of_transformed(&chains, |x| f64::from(x <= q))
}

fn of_transformed(chains: &[&[f64]], f: impl Fn(f64) -> f64) -> f64 {
    let halves = split(chains);
    let halves: Vec<Vec<f64>> =
        halves.iter().map(|half| half.iter().map(|&x| f(x)).collect()).collect();
    effective_size(&borrow(&halves))
}

/// Effective sample size S/τ of S draws, with the autocorrelation time τ from Geyer's initial monotone sequence. Lags
/// are summed in pairs while the pair sum is positive, and no pair sum is allowed to exceed the previous pair sum. τ
/// is at least 1/log₁₀ S, because for antithetic chains a smaller estimate would be unreliable.
fn effective_size(chains: &[&[f64]]) -> f64 {
    let draws = chains[0].len();
    if draws < 2 {
        return f64::NAN;
    }
    let n = draws as f64;
    let covariance = autocovariance(chains);
    let start = covariance[0];
    let within = start * n / (n - 1.0);
    let mut total = start;
    if chains.len() > 1 {
        total += mean_and_variance(chains.iter().map(|c| mean(c.iter().copied()))).1;
    }
    if total <= 0.0 {
        return f64::NAN; // the quantity is constant
    }
    let correlation = |lag: usize| 1.0 - (within - covariance[lag]) / total;

    let mut tau = -1.0;
    let mut smallest = f64::INFINITY;
    let (mut even, mut odd) = (1.0, correlation(1));
    let mut lag = 2;
    while even + odd > 0.0 && lag + 2 < draws {
        smallest = smallest.min(even + odd);
        tau += 2.0 * smallest;
        (even, odd) = (correlation(lag), correlation(lag + 1));
        lag += 2;
    }
    tau += even.max(0.0);

    let size = n * chains.len() as f64;
    size / tau.max(1.0 / size.log10())
}
