//! Neighbouring slices in exchanged order.
//!
//! Slices differ the more, the larger their distance. If two neighbouring slices b and c are exchanged, the slices are in
//! the order a, c, b, d: then the differences a–c and b–d exceed the differences a–b and c–d, which are the differences
//! of neighbouring slices. The first and the last slice of a stack have one neighbour only and are not checked.

use super::foreign::Foreign;
use super::pairs::{Pair, median, neighbours};
use super::samples::Samples;
use crate::listing::listed;

/// Smallest change of the difference by an exchange of two slices, as a share of the usual increase of the difference
/// with the distance of slices. The change is 1 for exchanged slices and −1 for slices in the right order.
const EXCHANGED: f64 = 0.5;
/// Smallest distance of a change from the usual change, in usual deviations of the changes nearby.
const UNUSUAL: f64 = 5.0;
/// Smallest ratio of two usual differences: of slices that are two slices apart, to neighbouring slices. Below this
/// ratio, noise hides the grains.
const VISIBLE: f64 = 1.1;
/// Number of pairs of slices before and after a pair from which the usual changes are computed.
const NEARBY: usize = 8;
/// Number of pairs of slices before and after a pair that must show the same content.
const AROUND: usize = 2;

/// Differences of the slices around a pair of neighbouring slices.
#[derive(Clone, Copy)]
struct Around {
    /// Sum of the differences in the order of the stack, minus the sum with the two slices exchanged.
    change: f64,
    /// Sum of the differences in the order of the stack.
    in_order: f64,
}

/// Returns a warning about neighbouring slices in exchanged order.
pub(super) fn exchanged(samples: &Samples, pairs: &[Pair], strangers: &Foreign) -> Option<String> {
    let around = |k: usize| {
        let in_order = samples.variance(k - 1, k) + samples.variance(k + 1, k + 2);
        let other = samples.variance(k - 1, k + 1) + samples.variance(k, k + 2);
        Around { change: in_order - other, in_order }
    };
    let checked = 1..pairs.len().saturating_sub(1);
    let all: Vec<Around> = checked.clone().map(around).collect();
    let is_exchanged = |k: &usize| {
        let is_alike = |k: usize| neighbours(pairs, k, AROUND).iter().all(|pair| pair.is_alike());
        if !is_alike(*k) || (k - 1..k + 2).any(|k| strangers.is_in_pair(k)) {
            return false;
        }
        let index = k - 1;
        // the pairs that contain one of the two slices also have unusual differences
        let near = || {
            let range = index.saturating_sub(NEARBY)..(index + NEARBY + 1).min(all.len());
            range.filter(|other| other.abs_diff(index) > 2).map(|other| all[other])
        };
        let Some(usual) = median(near().map(|around| around.change)) else { return false };
        let deviation = median(near().map(|around| (around.change - usual).abs()));
        let in_order = median(near().map(|around| around.in_order));
        let [Some(deviation), Some(in_order)] = [deviation, in_order] else { return false };
        let change = all[index].change;
        -usual > (VISIBLE - 1.0) * in_order
            && change > -EXCHANGED * usual
            && change - usual > UNUSUAL * deviation
    };
    let found: Vec<String> =
        checked.filter(is_exchanged).map(|k| format!("slices {} and {}", k + 1, k + 2)).collect();
    (!found.is_empty()).then(|| {
        format!(
            "Grains are wrong if slices are in the wrong order: {} fit better in exchanged order.",
            listed(&found, ", ")
        )
    })
}
