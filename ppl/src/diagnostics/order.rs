//! Order statistics: quantiles, ranks and normal scores.

use crate::special::normal_upper_quantile;

/// Quantile by linear interpolation between order statistics (type 7 of Hyndman & Fan 1996).
///
/// NaN if `values` is empty or contains NaN.
///
/// ```
/// assert_eq!(ppl::diagnostics::quantile(&[3.0, 1.0, 2.0, 4.0], 0.5), 2.5);
/// ```
pub fn quantile(values: &[f64], probability: f64) -> f64 {
    if values.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    quantile_of_sorted(&sorted, probability)
}

pub(crate) fn quantile_of_sorted(sorted: &[f64], probability: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let position = probability.clamp(0.0, 1.0) * last as f64;
    let below = position.floor() as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    if low == high {
        // avoids NaN from ∞ − ∞
        low
    } else {
        low + (position - below as f64) * (high - low)
    }
}

/// Normal scores z = Φ⁻¹((r − 3/8)/(S + 1/4)) of the ranks r = 1 … S over all chains, in the order of the draws. Ties
/// get their average rank.
pub(super) fn normal_scores(chains: &[&[f64]]) -> Vec<Vec<f64>> {
    let mut scores: Vec<Vec<f64>> = chains.iter().map(|chain| vec![0.0; chain.len()]).collect();
    let mut order: Vec<(f64, usize, usize)> = Vec::new();
    for (c, chain) in chains.iter().enumerate() {
        order.extend(chain.iter().enumerate().map(|(i, &x)| (x, c, i)));
    }
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total = order.len() as f64;
    let mut before = 0.0;
    for ties in order.chunk_by(|a, b| a.0 == b.0) {
        let count = ties.len() as f64;
        let rank = before + (count + 1.0) / 2.0;
        let score = normal_upper_quantile((total - rank + 0.625) / (total + 0.25));
        for &(_, chain, draw) in ties {
            scores[chain][draw] = score;
        }
        before += count;
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantile_interpolates_and_refuses_nan() {
        let values = [10.0, 0.0, 30.0, 20.0];
        assert_eq!(quantile(&values, 0.0), 0.0);
        assert_eq!(quantile(&values, 1.0), 30.0);
        assert!((quantile(&values, 0.25) - 7.5).abs() < 1e-14);
        assert!(quantile(&[], 0.5).is_nan());
        assert!(quantile(&[1.0, f64::NAN], 0.5).is_nan());
        assert_eq!(quantile(&[f64::INFINITY, f64::INFINITY], 0.5), f64::INFINITY);
    }

    #[test]
    fn tied_values_share_their_average_rank() {
        let [first, second] = &normal_scores(&[&[1.0, 2.0], &[2.0, 3.0]])[..] else {
            panic!("two")
        };
        assert_eq!(first[1], second[0]);
        assert!(first[1].abs() < 1e-15, "the middle rank is the median");
        assert!((first[0] + second[1]).abs() < 1e-15, "symmetric ranks");
        // Φ⁻¹(0.625/4.25) from a table of the normal distribution
        assert!((first[0] + 1.0491313979639705).abs() < 1e-9);
    }
}
