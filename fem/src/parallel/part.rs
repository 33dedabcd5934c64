//! The elements and nodes of one rank.

use std::sync::Arc;

use bytemuck::Pod;

use super::halo::{Halo, Neighbour};
use super::ranks::Ranks;

/// What a rank has of a mesh: some elements and all their nodes. Of a rank that is alone, everything.
///
/// Local nodes are numbered by kind (the vertices of the mesh, then the nodes on edges), of each kind the
/// own ones first, of these in the order of the mesh. A node belongs to the lowest rank that has an element with it.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Elements by their numbers in the mesh.
    pub(crate) tets: Vec<u32>,
    /// Local nodes by their numbers in the mesh.
    pub(crate) nodes: Vec<u32>,
    /// Nodes of all ranks.
    pub(crate) all_nodes: usize,
    pub(crate) halo: Arc<Halo>,
    /// The same without the nodes on edges.
    pub(crate) vertices: Arc<Halo>,
}

/// Marks what this rank does not have.
const ABSENT: u32 = u32::MAX;

impl Part {
    /// The part of one of the ranks, where `of` is the rank of each element; of `nodes` nodes the first
    /// `vertices` are those of the mesh.
    pub(crate) fn new<'a>(
        ranks: &Ranks,
        of: &[u32],
        nodes_of: impl Fn(usize) -> &'a [u32],
        [nodes, vertices]: [usize; 2],
    ) -> Self {
        let rank = ranks.rank() as u32;
        let tets: Vec<u32> = (0..of.len() as u32).filter(|&t| of[t as usize] == rank).collect();
        let mut here = vec![false; nodes];
        for &tet in &tets {
            nodes_of(tet as usize).iter().for_each(|&n| here[n as usize] = true);
        }
        // (node, rank) of all ranks that have a node of this one
        let mut shared: Vec<(u32, u32)> = Vec::new();
        let mut owner: Vec<u32> = here.iter().map(|&h| if h { rank } else { ABSENT }).collect();
        for (tet, &other) in of.iter().enumerate().filter(|(_, other)| **other != rank) {
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
        let count = |edge: bool, own: bool| {
            list.iter()
                .filter(|&&n| is_edge(n) == edge && (owner[n as usize] == rank) == own)
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
            let place = local[node as usize];
            if owner[node as usize] == rank {
                neighbours[other as usize].lent.push(place);
            } else if owner[node as usize] == other {
                neighbours[other as usize].ghosts.push(place);
            }
        }
        let own = [0..own_vertices, own_edges];
        let halo = |limit: usize| {
            let below = |places: &[u32]| -> Vec<u32> {
                places.iter().copied().filter(|&p| (p as usize) < limit).collect()
            };
            let kept = neighbours.iter().map(|n| Neighbour {
                rank: n.rank,
                lent: below(&n.lent),
                ghosts: below(&n.ghosts),
            });
            let kept = kept.filter(|n| !n.lent.is_empty() || !n.ghosts.is_empty()).collect();
            let own = own.clone().map(|range| range.start.min(limit)..range.end.min(limit));
            Arc::new(Halo::new(ranks.clone(), own, kept))
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

    /// The local number of each node of the mesh that this rank has.
    pub(crate) fn local(&self) -> impl Fn(u32) -> Option<u32> + use<> {
        let mut local = vec![ABSENT; self.all_nodes];
        self.nodes.iter().zip(0..).for_each(|(&n, i)| local[n as usize] = i);
        move |node| Some(local[node as usize]).filter(|&place| place != ABSENT)
    }

    /// Nodal values of the whole mesh, from those of all ranks.
    pub(crate) fn gather_nodes<T: Pod>(&self, values: &[T]) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        let own = |all: &[T]| self.halo.own_of(all).copied().collect::<Vec<T>>();
        let numbers: Vec<u32> = self.halo.own_of(&self.nodes).copied().collect();
        self.ordered(&numbers, 1, &own(values), self.all_nodes)
    }

    /// Values of all elements of the mesh, `width` each.
    pub(crate) fn gather_tets<T: Pod>(&self, values: &[T]) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        let width = values.len() / self.tets.len().max(1);
        let all: usize =
            self.ranks().gather(&[self.tets.len() as u64]).iter().map(|n| n[0] as usize).sum();
        self.ordered(&self.tets, width, values, all)
    }

    /// What all ranks have, `width` values each, in the order of its numbers from 0 to `all`.
    pub(crate) fn ordered<T: Pod>(
        &self,
        numbers: &[u32],
        width: usize,
        values: &[T],
        all: usize,
    ) -> Vec<T> {
        let mut out = vec![T::zeroed(); all * width];
        let numbers = self.ranks().gather(numbers);
        for (numbers, values) in numbers.iter().zip(self.ranks().gather(values)) {
            for (&number, value) in numbers.iter().zip(values.chunks_exact(width.max(1))) {
                out[number as usize * width..][..width].copy_from_slice(value);
            }
        }
        out
    }

    /// Those of its nodes, of nodal values of the whole mesh.
    pub(crate) fn pick_nodes<T: Copy>(&self, values: &[T]) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        self.nodes.iter().map(|&n| values[n as usize]).collect()
    }

    /// Those of its elements, `width` each.
    pub(crate) fn pick_tets<T: Copy>(&self, values: &[T], width: usize) -> Vec<T> {
        if self.is_whole() || values.is_empty() {
            return values.to_vec();
        }
        let of = |&tet: &u32| &values[tet as usize * width..][..width];
        self.tets.iter().flat_map(of).copied().collect()
    }
}
