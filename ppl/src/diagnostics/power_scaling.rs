//! How far a quantity moves when a part of the posterior is raised to a power.

use super::{ess_mean, pareto_smooth};

/// Relative change of the power on either side of 1.
const STEP: f64 = 0.01;

/// Response of one quantity to scaling one part of the density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PowerScaled {
    /// Change of the distribution per doubling of the power, in cumulative Jensen–Shannon distance.
    pub(crate) sensitivity: f64,
    /// Larger Pareto shape k of the two sets of importance ratios.
    pub(crate) pareto_k: f64,
}

/// Sensitivity of quantities to the part of the log density whose values at the draws are
/// `log_part`, as prior or likelihood; one result for each of `quantities`.
///
/// The posterior with that part to the power α has importance ratios part^(α − 1). With α = 1.01
/// and 1/1.01, smoothed by PSIS, the sensitivity is (d(α) + d(1/α)) / (2 log₂ α), d the
/// [`cjs_distance`] between the plain and the weighted draws.
///
/// `log_part` has one slice a chain, every quantity all draws chain after chain.
///
/// # References
/// Kallioinen, Paananen, Bürkner & Vehtari (2024), *Statistics and Computing* 34, 57,
/// doi:10.1007/s11222-023-10366-5.
pub(crate) fn power_scaled(log_part: &[&[f64]], quantities: &[&[f64]]) -> Vec<PowerScaled> {
    let weights = [1.0 + STEP, 1.0 / (1.0 + STEP)].map(|alpha| weights(log_part, alpha));
    let pareto_k = weights[0].1.max(weights[1].1);
    quantities
        .iter()
        .map(|x| {
            let moved: f64 = weights.iter().map(|(w, _)| cjs_distance(x, w)).sum();
            PowerScaled { sensitivity: moved / (2.0 * (1.0 + STEP).log2()), pareto_k }
        })
        .collect()
}

/// Smoothed, normalised weights of the posterior with the part to the power `alpha`, and their k.
fn weights(log_part: &[&[f64]], alpha: f64) -> (Vec<f64>, f64) {
    let mut log_weights: Vec<f64> =
        log_part.iter().copied().flatten().map(|l| (alpha - 1.0) * l).collect();
    let top = log_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let ratios: Vec<Vec<f64>> = log_part
        .iter()
        .map(|chain| chain.iter().map(|l| ((alpha - 1.0) * l - top).exp()).collect())
        .collect();
    let chains: Vec<&[f64]> = ratios.iter().map(Vec::as_slice).collect();
    let relative = ess_mean(&chains) / log_weights.len() as f64;
    let k = pareto_smooth(&mut log_weights, if relative.is_nan() { 1.0 } else { relative });
    (log_weights.into_iter().map(f64::exp).collect(), k)
}

/// Cumulative Jensen–Shannon distance between draws with equal weights and the same draws with
/// the given ones: 0 for equal distributions, at most 1.
///
/// For the distribution functions P and Q, CJS(P‖Q) = ∫ P log₂(2P/(P + Q)) dx +
/// (∫ Q dx − ∫ P dx)/(2 ln 2); the sum of both directions over ∫ P dx + ∫ Q dx, and its root. It
/// depends on the sign of x, so the larger of x and −x counts. NaN for draws that are not finite.
///
/// # References
/// Nguyen & Vreeken (2015), doi:10.1007/978-3-319-23525-7_11; Kallioinen et al. (2024), section 2.3.
fn cjs_distance(draws: &[f64], weights: &[f64]) -> f64 {
    if draws.iter().any(|x| !x.is_finite()) {
        return f64::NAN;
    }
    let mut order: Vec<usize> = (0..draws.len()).collect();
    order.sort_unstable_by(|&a, &b| draws[a].total_cmp(&draws[b]));
    let total: f64 = weights.iter().sum();
    let n = draws.len() as f64;
    let [mut below_p, mut below_q] = [0.0, 0.0];
    let mut sums = [Integrals::default(), Integrals::default()];
    for pair in order.windows(2) {
        below_p += 1.0 / n;
        below_q += weights[pair[0]] / total;
        let width = draws[pair[1]] - draws[pair[0]];
        sums[0].add(below_p, below_q, width);
        // the distribution function of −x on the same interval
        sums[1].add(1.0 - below_p, (1.0 - below_q).max(0.0), width);
    }
    let [upward, downward] = sums.map(|s| s.distance());
    upward.max(downward)
}

/// The integrals of the cumulative divergence, in both directions together: there the linear
/// terms cancel.
#[derive(Clone, Copy, Default)]
struct Integrals {
    divergence: f64,
    bound: f64,
}

impl Integrals {
    fn add(&mut self, p: f64, q: f64, width: f64) {
        let middle = 0.5 * (p + q);
        let term = |p: f64| if p > 0.0 { p * (p / middle).log2() } else { 0.0 };
        self.divergence += width * (term(p) + term(q));
        self.bound += width * (p + q);
    }

    fn distance(self) -> f64 {
        if self.bound > 0.0 { (self.divergence.max(0.0) / self.bound).sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/diagnostics_power_scaling.rs"]
mod tests;
