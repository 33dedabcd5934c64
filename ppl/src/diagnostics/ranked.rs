//! The draws of one number, sorted once for all that depends on their order.

use super::order::{Scores, ascending, folded, quantile_of_sorted};
use super::{split, usable};

/// Usable chains with the normal scores of their halves.
pub(super) struct Ranked<'a> {
    /// Cut to their common length.
    pub(super) chains: Vec<&'a [f64]>,
    /// All draws, ascending.
    sorted: Vec<f64>,
    /// The draws of the halves with their places in them, ascending.
    order: Vec<(f64, u32)>,
    /// Normal scores of the halves, one after the other.
    pub(super) scores: Vec<f64>,
    table: Option<&'a Scores>,
}

impl<'a> Ranked<'a> {
    /// With the scores of a table, if it is of that many ranks.
    pub(super) fn new(chains: &[&'a [f64]], table: Option<&'a Scores>) -> Option<Self> {
        let chains = usable(chains)?;
        let order = ascending(split(&chains).into_iter().flatten().copied());
        let all = chains.iter().copied().flatten().copied();
        let sorted = if chains[0].len() % 2 == 0 {
            order.iter().map(|&(x, _)| x).collect()
        } else {
            // the middle draw of an odd chain belongs to neither half
            ascending(all).into_iter().map(|(x, _)| x).collect()
        };
        let mut ranked = Self { chains, sorted, order, scores: Vec::new(), table };
        ranked.scores = ranked.score(&ranked.order);
        Some(ranked)
    }

    fn score(&self, order: &[(f64, u32)]) -> Vec<f64> {
        match self.table.filter(|table| table.len() == order.len()) {
            Some(table) => table.of(order),
            None => Scores::new(order.len()).of(order),
        }
    }

    /// Normal scores of the distances from the median of the halves.
    pub(super) fn folded_scores(&self) -> Vec<f64> {
        let values: Vec<f64> = self.order.iter().map(|&(x, _)| x).collect();
        self.score(&folded(&self.order, quantile_of_sorted(&values, 0.5)))
    }

    /// The halves of numbers that stand one half after the other.
    pub(super) fn halves<'n>(&self, numbers: &'n [f64]) -> Vec<&'n [f64]> {
        numbers.chunks_exact(self.chains[0].len() / 2).collect()
    }

    pub(super) fn quantile(&self, probability: f64) -> f64 {
        quantile_of_sorted(&self.sorted, probability)
    }
}
