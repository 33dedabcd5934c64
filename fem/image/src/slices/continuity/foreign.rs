//! Slices of another image: slices that differ from both of their neighbours, which resemble each other, and slices of
//! two images that alternate.

use super::pairs::{Pair, median};
use crate::listing::listed;

/// A slice counts as foreign if its difference from its neighbours exceeds this multiple of both: the difference
/// between its two neighbours, and the usual difference of neighbouring slices.
const FOREIGN: f64 = 3.0;
/// Slices of two images alternate if the difference between a slice and the slice after the next is below this share of
/// the difference between the slice and the next slice.
const ALTERNATE: f64 = 0.7;
/// Share of the slices above which slices of two images alternate.
const MOST: f64 = 0.8;

/// Foreign slices, counted from 0.
pub(super) struct Foreign {
    pub(super) slices: Vec<usize>,
}

pub(super) fn foreign(pairs: &[Pair]) -> Foreign {
    let usual = median(pairs.iter().map(|pair| pair.next)).unwrap_or(0.0);
    let is_foreign = |k: &usize| {
        let least = pairs[k - 1].next.min(pairs[*k].next);
        least > FOREIGN * usual.max(pairs[k - 1].after_next)
    };
    Foreign { slices: (1..pairs.len()).filter(is_foreign).filter(|_| usual > 0.0).collect() }
}

impl Foreign {
    /// Returns whether slice `k` or slice `k` + 1 is foreign.
    pub(super) fn is_in_pair(&self, k: usize) -> bool {
        self.slices.iter().any(|&slice| slice == k || slice == k + 1)
    }

    pub(super) fn in_words(&self) -> Option<String> {
        let numbers: Vec<String> = self.slices.iter().map(|k| (k + 1).to_string()).collect();
        (!numbers.is_empty()).then(|| {
            format!(
                "Grains are wrong near slices of another image: slice {} differs from both neighbours, which are alike.",
                listed(&numbers, ", ")
            )
        })
    }
}

/// Returns a warning if slices of two images alternate: nearly every slice resembles the slice after the next more than
/// the next slice.
pub(super) fn alternating(pairs: &[Pair]) -> Option<String> {
    let compared: Vec<&Pair> =
        pairs.iter().filter(|pair| pair.next > 0.0 && pair.after_next.is_finite()).collect();
    let alternate =
        compared.iter().filter(|pair| pair.after_next < ALTERNATE * pair.next).count() as f64;
    (!compared.is_empty() && alternate > MOST * compared.len() as f64).then(|| {
        "Heights and grains are wrong if slices of two images alternate: nearly every slice resembles the slice after the next more \
         than the next slice, as with two channels; save each image as a separate stack."
            .to_owned()
    })
}
