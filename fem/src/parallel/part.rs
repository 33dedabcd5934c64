//! The elements and nodes of one rank.

use std::sync::Arc;

use bytemuck::Pod;

use super::halo::{Halo, Neighbour};
use super::ranks::Ranks;

/// The part of a mesh that belongs to one rank: some elements and all their nodes. A single rank has the whole mesh.
///
/// Local nodes are numbered in this order: vertices of the mesh, then nodes on edges. Within each kind, nodes that the
/// rank owns are first. Within each of these groups, nodes are in the order of the mesh. A node is owned by the lowest
/// rank that has an element with this node.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// For each local element, its number in the whole mesh.
    pub(crate) tets: Vec<u32>,
    /// For each local node, its number in the whole mesh.
    pub(crate) nodes: Vec<u32>,
    /// Number of nodes of the whole mesh.
    pub(crate) all_nodes: usize,
    /// The shared nodes.
    pub(crate) halo: Arc<Halo>,
    /// Vertices of the mesh that this rank shares with other ranks.
    pub(crate) vertices: Arc<Halo>,
}

/// Placeholder for the local number of a node that this rank does not have.
const ABSENT: u32 = u32::MAX;

impl Part {
    /// Creates the part of the calling rank. `nodes_of` returns the nodes of an element. Of the `nodes` nodes, the
    /// first `vertices` are vertices of the mesh, and all others are on edges.
    pub(crate) fn new<'a>(
        ranks: &Ranks,
        rank_of_tet: &[u32],
        nodes_of: impl Fn(usize) -> &'a [u32],
        [nodes, vertices]: [usize; 2],
    ) -> Self {
        let rank = ranks.rank() as u32;
        let tets: Vec<u32> =
            (0..rank_of_tet.len() as u32).filter(|&t| rank_of_tet[t as usize] == rank).collect();
        let mut here = vec![false; nodes];
        for &tet in &tets {
            nodes_of(tet as usize).iter().for_each(|&n| here[n as usize] = true);
        }
        // one pair (node, rank) for each node of this rank and each other rank that has this node
        let mut shared: Vec<(u32, u32)> = Vec::new();
        let mut owner: Vec<u32> = here.iter().map(|&h| if h { rank } else { ABSENT }).collect();
        for (tet, &other) in rank_of_tet.iter().enumerate().filter(|(_, other)| **other != rank) {
            for &node in nodes_of(tet).iter().filter(|n| here[**n as usize]) {
                shared.push((node, other));
                owner[node as usize] = owner[node as usize].min(other);
            }
        }
        shared.sort_unstable();
        shared.dedup();
        let mut list: Vec<u32> = (0..nodes as u32).filter(|&n| here[n as usize]).collect();
        let is_edge = |n: u32| n as usize >= vertices;
        list.sort_by_key(|&n| (is_edge(n), owner[n as usize] != rank));
        let count = |edge: bool, is_owned: bool| {
            list.iter()
                .filter(|&&n| is_edge(n) == edge && (owner[n as usize] == rank) == is_owned)
                .count()
        };
        let (own_vertices, local_vertices) =
            (count(false, true), count(false, true) + count(false, false));
        let own_edges = local_vertices..local_vertices + count(true, true);
        let mut local = vec![ABSENT; nodes];
        list.iter().zip(0..).for_each(|(&n, i)| local[n as usize] = i);
        let mut neighbours: Vec<Neighbour> =
            (0..ranks.size()).map(|rank| Neighbour { rank, ..Neighbour::default() }).collect();
        for &(node, other) in &shared {
            let local_node = local[node as usize];
            if owner[node as usize] == rank {
                neighbours[other as usize].lent.push(local_node);
            } else if owner[node as usize] == other {
                neighbours[other as usize].ghosts.push(local_node);
            }
        }
        let owned = [0..own_vertices, own_edges];
        let halo = |limit: usize| {
            let below = |local_nodes: &[u32]| -> Vec<u32> {
                local_nodes.iter().copied().filter(|&n| (n as usize) < limit).collect()
            };
            let restricted = neighbours.iter().map(|n| Neighbour {
                rank: n.rank,
                lent: below(&n.lent),
                ghosts: below(&n.ghosts),
            });
            let restricted =
                restricted.filter(|n| !n.lent.is_empty() || !n.ghosts.is_empty()).collect();
            let owned = owned.clone().map(|range| range.start.min(limit)..range.end.min(limit));
            Arc::new(Halo::new(ranks.clone(), owned, restricted))
        };
        let (vertices, halo) = (halo(local_vertices), halo(list.len()));
        Self { tets, nodes: list, all_nodes: nodes, halo, vertices }
    }

    pub(crate) fn ranks(&self) -> &Ranks {
        self.halo.ranks()
    }

    pub(crate) fn is_whole(&self) -> bool {
        self.ranks().is_alone()
    }

    /// Returns a function that converts the number of a node in the mesh to its local number; `None` if this rank does
    /// not have the node.
    pub(crate) fn local(&self) -> impl Fn(u32) -> Option<u32> + use<> {
        let mut local = vec![ABSENT; self.all_nodes];
        self.nodes.iter().zip(0..).for_each(|(&n, i)| local[n as usize] = i);
        move |node| Some(local[node as usize]).filter(|&local_node| local_node != ABSENT)
    }

    /// Collects the nodal values of the whole mesh from all ranks.
    pub(crate) fn gather_nodes<T: Pod>(&self, values: &[T]) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        let owned = |all: &[T]| self.halo.own_of(all).copied().collect::<Vec<T>>();
        let node_ids: Vec<u32> = self.halo.own_of(&self.nodes).copied().collect();
        self.ordered(&node_ids, 1, &owned(values), self.all_nodes)
    }

    /// Collects the element values of the whole mesh from all ranks.
    pub(crate) fn gather_tets<T: Pod>(&self, values: &[T]) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        let width = values.len() / self.tets.len().max(1);
        let all: usize =
            self.ranks().gather(&[self.tets.len() as u64]).iter().map(|n| n[0] as usize).sum();
        self.ordered(&self.tets, width, values, all)
    }

    /// Collects values of items (nodes or elements) from all ranks. This rank contributes `width` values for each item
    /// in `ids`, a list of numbers in the whole mesh. The result is ordered by item number, from 0 to `all` − 1.
    pub(crate) fn ordered<T: Pod>(
        &self,
        ids: &[u32],
        width: usize,
        values: &[T],
        all: usize,
    ) -> Vec<T> {
        let mut out = vec![T::zeroed(); all * width];
        let ids = self.ranks().gather(ids);
        for (ids, values) in ids.iter().zip(self.ranks().gather(values)) {
            for (&number, value) in ids.iter().zip(values.chunks_exact(width.max(1))) {
                out[number as usize * width..][..width].copy_from_slice(value);
            }
        }
        out
    }

    /// Selects the values of this rank's nodes from the nodal values of the whole mesh.
    pub(crate) fn pick_nodes<T: Copy>(&self, values: &[T]) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        self.nodes.iter().map(|&n| values[n as usize]).collect()
    }

    /// Selects the values of this rank's elements from the element values of the whole mesh; `width` values per
    /// element.
    pub(crate) fn pick_tets<T: Copy>(&self, values: &[T], width: usize) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        let of_tet = |&tet: &u32| &values[tet as usize * width..][..width];
        self.tets.iter().flat_map(of_tet).copied().collect()
    }
}
