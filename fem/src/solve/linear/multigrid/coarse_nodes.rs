//! Numbering of the nodes of a coarse level over all ranks.

use std::sync::Arc;

use super::block_csr::BlockCsr;
use crate::parallel::{Halo, Ranks};

/// Coarse nodes on this rank: first the nodes that this rank owns, then the nodes of other ranks that occur in the
/// matrix rows of this rank. Both groups are sorted by their numbers over all ranks.
#[derive(Debug)]
pub(super) struct CoarseNodes {
    /// Number of the first node that each rank owns; the last entry is the number of nodes on all ranks.
    pub(super) first: Vec<usize>,
    /// Numbers (over all ranks) of the nodes of other ranks.
    ghosts: Vec<u32>,
    pub(super) halo: Arc<Halo>,
}

/// Returns the number of the first node that each rank owns; the last entry is the number of nodes on all ranks.
/// `owned` is the number of nodes that this rank owns.
pub(super) fn first_numbers(ranks: &Ranks, owned: usize) -> Vec<usize> {
    let mut first = vec![0];
    for count in ranks.gather(&[owned as u64]) {
        first.push(first[first.len() - 1] + count[0] as usize);
    }
    first
}

impl CoarseNodes {
    /// Creates the numbering of the nodes that this rank owns, and of the nodes of other ranks that occur in the columns
    /// of `rows`.
    pub(super) fn new<const R: usize, const C: usize>(
        ranks: &Ranks,
        first: Vec<usize>,
        rows: &BlockCsr<f64, R, C>,
    ) -> Self {
        let owned = first[ranks.rank()]..first[ranks.rank() + 1];
        let others = rows.column.iter().copied().filter(|&c| !owned.contains(&(c as usize)));
        let mut ghosts: Vec<u32> = others.collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let halo = Arc::new(Halo::of_ghosts(ranks, &first, &ghosts));
        Self { first, ghosts, halo }
    }

    /// Returns the number of nodes on all ranks.
    pub(super) fn all(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// Returns the numbers (over all ranks) of the nodes that this rank owns.
    fn owned(&self) -> std::ops::Range<usize> {
        let rank = self.halo.ranks().rank();
        self.first[rank]..self.first[rank + 1]
    }

    /// Converts the column numbers of `rows` from numbers over all ranks to local numbers.
    pub(super) fn localise<const R: usize, const C: usize>(
        &self,
        rows: BlockCsr<f64, R, C>,
    ) -> BlockCsr<f64, R, C> {
        let owned = self.owned();
        let local = |number: u32| match self.ghosts.binary_search(&number) {
            Ok(ghost) => (owned.len() + ghost) as u32,
            Err(_) => number - owned.start as u32,
        };
        let column = rows.column.iter().map(|&c| local(c)).collect();
        BlockCsr { columns: owned.len() + self.ghosts.len(), column, ..rows }
    }

    /// Returns, for each local node, its number over all ranks.
    pub(super) fn global_ids(&self) -> Vec<u32> {
        self.owned().map(|number| number as u32).chain(self.ghosts.iter().copied()).collect()
    }
}
