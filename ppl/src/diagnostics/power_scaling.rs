//! Power-scaling sensitivity: change of a quantity when a part of the posterior density is raised to a power.

use super::{ess_mean, pareto_smooth};

/// Relative change of the power: the powers are 1 + `STEP` and 1/(1 + `STEP`).
const STEP: f64 = 0.01;

/// Change of one quantity when one factor of the density, such as the prior, is raised to a power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PowerScaled {
    /// Change of the distribution per doubling of the power, as cumulative Jensen–Shannon distance.
    pub(crate) sensitivity: f64,
    /// Larger of the two Pareto shapes k of the importance ratios, for a power above 1 and a power below 1.
    pub(crate) pareto_k: f64,
}

/// Computes the power-scaling sensitivity of each of the `quantities` to one part of the density, such as the prior
/// or the likelihood. `log_part` contains the logarithm of this part at each draw.
///
/// If the part is raised to the power α, the draws have the importance ratios part^(α − 1). The ratios for α = 1.01
/// and α = 1/1.01 are smoothed by Pareto-smoothed importance sampling. The sensitivity is (d(α) + d(1/α)) / (2 log₂
/// α), where d is the [`cjs_distance`] between unweighted and weighted draws.
///
/// `log_part` has one slice per chain. Each quantity is one slice with the draws of all chains, concatenated.
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

/// Returns the smoothed, normalised importance weights of the draws if the part of the density is raised to the power
/// `alpha`, and the Pareto shape k of the weights.
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

/// Cumulative Jensen–Shannon distance between unweighted and weighted draws: 0 for equal distributions, at most 1.
///
/// For distribution functions P and Q, CJS(P‖Q) = ∫ P log₂(2P/(P + Q)) dx + (∫ Q dx − ∫ P dx)/(2 ln 2). The distance
/// is the square root of (CJS(P‖Q) + CJS(Q‖P)) / (∫ P dx + ∫ Q dx). Since this distance depends on the sign of x, the
/// result is the larger of the distances for x and for −x. NaN for draws that are not finite.
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
        // contribution to the distance for the distribution functions of −x
        sums[1].add(1.0 - below_p, (1.0 - below_q).max(0.0), width);
    }
    let [upward, downward] = sums.map(|s| s.distance());
    upward.max(downward)
}

/// Integrals of CJS(P‖Q) + CJS(Q‖P). The linear terms of both directions cancel.
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
