//! Exchange of values at nodes that several ranks share: values are added on the owner and sent back.

use std::ops::{AddAssign, Range};

use bytemuck::Pod;

use super::communicator::received;
use super::ranks::{Ranks, decoded};

/// A rank that shares nodes with this rank.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbour {
    pub(crate) rank: usize,
    /// Local numbers of the nodes that this rank owns and that are ghosts on the neighbour.
    pub(crate) lent: Vec<u32>,
    /// Local numbers of the ghosts that the neighbour owns.
    pub(crate) ghosts: Vec<u32>,
}

/// The nodes that this rank shares with other ranks. The halo is empty if there is only one rank.
///
/// Each node has exactly one owner. On every other rank that has the node, the node is a ghost.
#[derive(Clone, Debug, Default)]
pub(crate) struct Halo {
    ranks: Ranks,
    /// Ranges of local numbers of the nodes that this rank owns: first the vertices, then the nodes on edges. The
    /// ranges are not used if there is only one rank.
    owned_ranges: [Range<usize>; 2],
    /// Neighbours, in increasing order of their ranks.
    neighbours: Vec<Neighbour>,
}

impl Halo {
    pub(crate) fn new(
        ranks: Ranks,
        owned_ranges: [Range<usize>; 2],
        neighbours: Vec<Neighbour>,
    ) -> Self {
        Self { ranks, owned_ranges, neighbours }
    }

    /// Creates the halo of items that are numbered over all ranks: rank r owns the items from `first[r]` to `first[r +
    /// 1]` − 1. A rank stores the items that it owns first, then `ghosts`, which are given by their global numbers in
    /// increasing order.
    pub(crate) fn of_ghosts(ranks: &Ranks, first: &[usize], ghosts: &[u32]) -> Self {
        let rank = ranks.rank();
        let owned = first[rank + 1] - first[rank];
        let mut neighbours: Vec<Neighbour> = Vec::new();
        for (k, &ghost) in ghosts.iter().enumerate() {
            let owner = first.partition_point(|&f| f <= ghost as usize) - 1;
            if neighbours.last().is_none_or(|n| n.rank != owner) {
                neighbours.push(Neighbour { rank: owner, ..Neighbour::default() });
            }
            let neighbour = neighbours.last_mut().expect("the neighbour was added above");
            neighbour.ghosts.push((owned + k) as u32);
        }
        // a rank can compute the owners of its ghosts; the other ranks must send to this rank which of its items are
        // their ghosts
        let asked: Vec<u32> = neighbours.iter().map(|n| n.rank as u32).collect();
        for (other, asked) in ranks.gather(&asked).into_iter().enumerate() {
            if asked.contains(&(rank as u32)) && !neighbours.iter().any(|n| n.rank == other) {
                neighbours.push(Neighbour { rank: other, ..Neighbour::default() });
            }
        }
        neighbours.sort_by_key(|n| n.rank);
        let mut halo = Self::new(ranks.clone(), [0..owned, owned..owned], neighbours);
        let wanted = halo.neighbours.iter().map(|n| {
            let ghost_ids = n.ghosts.iter().map(|&g| ghosts[g as usize - owned]);
            ghost_ids.collect::<Vec<u32>>()
        });
        let lent = halo.exchange(wanted.collect());
        for (neighbour, lent) in halo.neighbours.iter_mut().zip(lent) {
            neighbour.lent = lent.iter().map(|&g| g - first[rank] as u32).collect();
        }
        halo
    }

    pub(crate) fn ranks(&self) -> &Ranks {
        &self.ranks
    }

    pub(crate) fn neighbours(&self) -> &[Neighbour] {
        &self.neighbours
    }

    /// Returns the ranges of the nodes that this rank owns, among its `nodes` local nodes.
    pub(crate) fn owned_ranges(&self, nodes: usize) -> [Range<usize>; 2] {
        if self.ranks.is_alone() { [0..nodes, nodes..nodes] } else { self.owned_ranges.clone() }
    }

    /// Whether this rank owns a node.
    pub(crate) fn owns(&self, node: u32) -> bool {
        let node = node as usize;
        self.ranks.is_alone() || self.owned_ranges.iter().any(|range| range.contains(&node))
    }

    /// Selects the values of the nodes that this rank owns.
    pub(crate) fn own_of<'a, T>(
        &self,
        values: &'a [T],
    ) -> impl Iterator<Item = &'a T> + use<'a, T> {
        let [a, b] = self.owned_ranges(values.len());
        values[a].iter().chain(&values[b])
    }

    /// Sends the k-th list to the k-th neighbour. Returns the lists that the neighbours sent, in the order of the
    /// neighbours.
    pub(crate) fn exchange<T: Pod>(&self, lists: Vec<Vec<T>>) -> Vec<Vec<T>> {
        let Some(others) = self.ranks.others() else { return Vec::new() };
        let messages = self.neighbours.iter().zip(lists);
        let messages = messages.map(|(n, list)| (n.rank, bytemuck::cast_slice(&list).to_vec()));
        let messages = received(others.exchange(messages.collect()));
        messages.iter().map(|bytes| decoded(bytes)).collect()
    }

    /// Overwrites the values of ghosts by the values of their owners.
    pub(crate) fn forward<T: Pod, const R: usize>(&self, values: &mut [[T; R]]) {
        if self.ranks.is_alone() {
            return;
        }
        let values = values.as_flattened_mut();
        let lists = self.neighbours.iter().map(|n| pick(values, &n.lent, R)).collect();
        for (neighbour, list) in self.neighbours.iter().zip(self.exchange(lists)) {
            for (&ghost, value) in neighbour.ghosts.iter().zip(list.chunks_exact(R)) {
                values[ghost as usize * R..][..R].copy_from_slice(value);
            }
        }
    }

    /// Replaces the values at shared nodes by the sums of the contributions of all ranks. Afterwards all ranks that
    /// share a node have the same sum.
    pub(crate) fn complete<T: Pod + AddAssign, const R: usize>(&self, values: &mut [[T; R]]) {
        if self.ranks.is_alone() {
            return;
        }
        let flat = values.as_flattened_mut();
        let lists = self.neighbours.iter().map(|n| pick(flat, &n.ghosts, R)).collect();
        for (neighbour, list) in self.neighbours.iter().zip(self.exchange(lists)) {
            for (&node, value) in neighbour.lent.iter().zip(list.chunks_exact(R)) {
                let sums = &mut flat[node as usize * R..][..R];
                sums.iter_mut().zip(value).for_each(|(sum, &v)| *sum += v);
            }
        }
        self.forward(values);
    }

    /// Replaces the R × R blocks at shared nodes by the sums of the contributions of all ranks, as [`Self::complete`]
    /// does for vectors.
    pub(crate) fn complete_blocks<const R: usize>(&self, blocks: &mut [[[f64; R]; R]]) {
        for row in 0..R {
            let mut rows: Vec<[f64; R]> = blocks.iter().map(|block| block[row]).collect();
            self.complete(&mut rows);
            blocks.iter_mut().zip(rows).for_each(|(block, values)| block[row] = values);
        }
    }
}

/// Returns the values of the given nodes, `width` values per node.
fn pick<T: Pod>(values: &[T], nodes: &[u32], width: usize) -> Vec<T> {
    let at_node = |&node: &u32| &values[node as usize * width..][..width];
    nodes.iter().flat_map(at_node).copied().collect()
}
