//! The nodes of a coarse level, on all ranks.

use std::sync::Arc;

use super::block_csr::BlockCsr;
use crate::parallel::{Halo, Ranks};

/// Which coarse nodes a rank has: its own ones first, then those of others that its rows refer to, both in
/// increasing order of their numbers over all ranks.
#[derive(Debug)]
pub(super) struct CoarseNodes {
    /// Where those of each rank begin, and where the last ones end.
    pub(super) first: Vec<usize>,
    /// The numbers of the others.
    ghosts: Vec<u32>,
    pub(super) halo: Arc<Halo>,
}

/// Where the numbers of each rank begin that has so many of its own.
pub(super) fn first_numbers(ranks: &Ranks, own: usize) -> Vec<usize> {
    let mut first = vec![0];
    for count in ranks.gather(&[own as u64]) {
        first.push(first[first.len() - 1] + count[0] as usize);
    }
    first
}

impl CoarseNodes {
    /// Those that the columns of `rows` refer to, beside the rank's own ones.
    pub(super) fn new<const R: usize, const C: usize>(
        ranks: &Ranks,
        first: Vec<usize>,
        rows: &BlockCsr<f64, R, C>,
    ) -> Self {
        let own = first[ranks.rank()]..first[ranks.rank() + 1];
        let others = rows.column.iter().copied().filter(|&c| !own.contains(&(c as usize)));
        let mut ghosts: Vec<u32> = others.collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let halo = Arc::new(Halo::of_ghosts(ranks, &first, &ghosts));
        Self { first, ghosts, halo }
    }

    /// On all ranks.
    pub(super) fn all(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    fn own(&self) -> std::ops::Range<usize> {
        let rank = self.halo.ranks().rank();
        self.first[rank]..self.first[rank + 1]
    }

    /// The same rows with the numbers of this rank.
    pub(super) fn localise<const R: usize, const C: usize>(
        &self,
        rows: BlockCsr<f64, R, C>,
    ) -> BlockCsr<f64, R, C> {
        let own = self.own();
        let local = |number: u32| match self.ghosts.binary_search(&number) {
            Ok(ghost) => (own.len() + ghost) as u32,
            Err(_) => number - own.start as u32,
        };
        let column = rows.column.iter().map(|&c| local(c)).collect();
        BlockCsr { columns: own.len() + self.ghosts.len(), column, ..rows }
    }

    /// The numbers over all ranks of those that this rank has.
    pub(super) fn numbers(&self) -> Vec<u32> {
        self.own().map(|number| number as u32).chain(self.ghosts.iter().copied()).collect()
    }
}
