//! Order statistics: quantiles, ranks and normal scores.

use crate::special::normal_upper_quantile;

/// Quantile by linear interpolation between order statistics (type 7 of Hyndman & Fan 1996).
///
/// NaN when `values` is empty or holds a NaN.
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
        // also keeps ±∞ from becoming NaN
        low
    } else {
        low + (position - below as f64) * (high - low)
    }
}

/// Values with their places, ascending.
pub(super) fn ascending(values: impl Iterator<Item = f64>) -> Vec<(f64, u32)> {
    let mut order: Vec<(f64, u32)> = values.zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    order
}

/// The order of |x − centre|, given that of x: both sides are in order already, and are merged.
pub(super) fn folded(order: &[(f64, u32)], centre: f64) -> Vec<(f64, u32)> {
    let (below, above) = order.split_at(order.partition_point(|&(x, _)| x < centre));
    let distance = |&(x, place): &(f64, u32)| ((x - centre).abs(), place);
    let mut left = below.iter().rev().map(distance).peekable();
    let mut right = above.iter().map(distance).peekable();
    std::iter::from_fn(|| match (left.peek(), right.peek()) {
        (Some(a), Some(b)) if a.0 < b.0 => left.next(),
        (_, Some(_)) => right.next(),
        _ => left.next(),
    })
    .collect()
}

/// Normal scores z = Φ⁻¹((r − 3/8)/(S + 1/4)) of the ranks 1 … S, computed once for all quantities
/// with so many draws.
pub(crate) struct Scores(Vec<f64>);

impl Scores {
    pub(crate) fn new(total: usize) -> Self {
        Self((1..=total).map(|rank| score(rank as f64, total as f64)).collect())
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Puts the score of its rank in the place of every value, where ties share their average rank.
    pub(super) fn of(&self, order: &[(f64, u32)]) -> Vec<f64> {
        let mut scores = vec![0.0; order.len()];
        let mut before = 0;
        for ties in order.chunk_by(|a, b| a.0 == b.0) {
            let count = ties.len();
            let score = if count == 1 {
                self.0[before]
            } else {
                score(before as f64 + (count as f64 + 1.0) / 2.0, order.len() as f64)
            };
            for &(_, place) in ties {
                scores[place as usize] = score;
            }
            before += count;
        }
        scores
    }
}

fn score(rank: f64, total: f64) -> f64 {
    normal_upper_quantile((total - rank + 0.625) / (total + 0.25))
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
        let scores = Scores::new(4).of(&ascending([1.0, 2.0, 2.0, 3.0].into_iter()));
        assert_eq!(scores[1], scores[2]);
        assert!(scores[1].abs() < 1e-15, "the middle rank is the median");
        assert!((scores[0] + scores[3]).abs() < 1e-15, "symmetric ranks");
        // Φ⁻¹(0.625/4.25) from tables of the normal distribution
        assert!((scores[0] + 1.0491313979639705).abs() < 1e-9);
    }

    #[test]
    fn folding_a_sorted_list_is_sorting_the_distances() {
        let x = [3.0, -1.0, 2.0, 2.0, 7.5, 0.0, -4.0, 2.5];
        for centre in [-9.0, -1.0, 2.0, 2.25, 8.0] {
            let merged = folded(&ascending(x.into_iter()), centre);
            let sorted = ascending(x.iter().map(|x| (x - centre).abs()));
            let values = |order: &[(f64, u32)]| order.iter().map(|o| o.0).collect::<Vec<_>>();
            assert_eq!(values(&merged), values(&sorted), "centre {centre}");
            assert!(merged.iter().all(|&(d, place)| d == (x[place as usize] - centre).abs()));
        }
    }
}
