//! Which tetrahedra touch, and labels that are corrected by their neighbours.

use rayon::prelude::*;

use crate::mesh::TetMesh;

/// The neighbours of each tetrahedron and the tetrahedra of each node.
pub(super) struct Adjacency<'a> {
    mesh: &'a TetMesh,
    /// Inner faces, as the two tetrahedra that meet there.
    faces: &'a [[u32; 2]],
    /// For each tetrahedron its inner faces, by number.
    faces_of: Vec<[u32; 4]>,
    /// The tetrahedra of node n stand in `tets_of` from `start[n]` to `start[n + 1]`.
    start: Vec<u32>,
    tets_of: Vec<u32>,
}

/// Passes of [`Adjacency::drop_spikes`].
const SPIKE_PASSES: usize = 4;
/// Stands for a face on the boundary.
const NONE: u32 = u32::MAX;

impl<'a> Adjacency<'a> {
    /// `faces` are [`TetMesh::neighbours`].
    pub(super) fn new(mesh: &'a TetMesh, faces: &'a [[u32; 2]]) -> Self {
        let mut faces_of = vec![[NONE; 4]; mesh.tets.len()];
        for (face, tets) in faces.iter().enumerate() {
            for &tet in tets {
                let places = &mut faces_of[tet as usize];
                let place = places.iter().position(|&f| f == NONE).expect("four faces at most");
                places[place] = face as u32;
            }
        }
        let mut start = vec![0; mesh.nodes.len() + 1];
        for &node in mesh.tets.as_flattened() {
            start[node as usize + 1] += 1;
        }
        for node in 0..mesh.nodes.len() {
            start[node + 1] += start[node];
        }
        let (mut next, mut tets_of) = (start.clone(), vec![0; 4 * mesh.tets.len()]);
        for (tet, nodes) in mesh.tets.iter().enumerate() {
            for &node in nodes {
                tets_of[next[node as usize] as usize] = tet as u32;
                next[node as usize] += 1;
            }
        }
        Self { mesh, faces, faces_of, start, tets_of }
    }

    /// The faces of a tetrahedron, and who is behind them.
    fn around(&self, tet: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.faces_of[tet as usize].iter().filter(|&&face| face != NONE).map(move |&face| {
            let [a, b] = self.faces[face as usize];
            (face, if a == tet { b } else { a })
        })
    }

    /// The tetrahedra of one label around this one, if there are fewer than `smallest`.
    fn component(&self, labels: &[u32], tet: u32, smallest: usize) -> Option<Vec<u32>> {
        let alike = |other: u32| labels[other as usize] == labels[tet as usize];
        // most have enough around them
        if 1 + self.around(tet).filter(|&(_, other)| alike(other)).count() >= smallest {
            return None;
        }
        let mut members = vec![tet];
        let mut seen = 0;
        while seen < members.len() {
            if members.len() >= smallest {
                return None;
            }
            for (_, other) in self.around(members[seen]) {
                if alike(other) && !members.contains(&other) {
                    members.push(other);
                }
            }
            seen += 1;
        }
        (members.len() < smallest).then_some(members)
    }

    /// Turns connected components of a grain with fewer than `smallest` tetrahedra into matrix, then
    /// such components of the matrix into the grain around them. In this order no small component is
    /// left: one of the matrix joins a grain that is large enough.
    pub(super) fn drop_small_components(&self, labels: &mut [u32], smallest: usize) -> usize {
        let mut changed = 0;
        for of_grain in [true, false] {
            let change = |tet: u32| {
                let own = labels[tet as usize];
                if (own > 0) != of_grain {
                    return None;
                }
                let members = self.component(labels, tet, smallest)?;
                let faces = members.iter().flat_map(|&member| self.around(member));
                let outside = faces.filter(|&(_, other)| labels[other as usize] != own);
                // of several grains around it, that behind the last of its faces
                let (_, beside) = outside.max()?;
                Some((tet, if of_grain { 0 } else { labels[beside as usize] }))
            };
            let tets = 0..labels.len() as u32;
            let changes: Vec<(u32, u32)> = tets.into_par_iter().filter_map(change).collect();
            changed += changes.len();
            changes.into_iter().for_each(|(tet, label)| labels[tet as usize] = label);
        }
        changed
    }

    /// Parts grains at the nodes that they share. At each node the grain with most tetrahedra stays,
    /// and after it those that are to be parted from none that stays; the tetrahedra of the others
    /// become matrix.
    pub(super) fn separate_grains(
        &self,
        labels: &mut [u32],
        is_parted: impl Fn(u32, u32) -> bool + Sync,
    ) -> usize {
        let leaving = |node: usize| {
            let mut claims = self.claims(labels, node);
            if claims.len() < 2 {
                return Vec::new();
            }
            // of equal claims that of the first grain
            claims.sort_unstable_by_key(|&(grain, count)| (std::cmp::Reverse(count), grain));
            let mut staying: Vec<u32> = Vec::new();
            for &(grain, _) in &claims {
                if !staying.iter().any(|&other| is_parted(grain, other)) {
                    staying.push(grain);
                }
            }
            let around = self.tets_of(node).iter().copied();
            around
                .filter(|&t| labels[t as usize] > 0 && !staying.contains(&labels[t as usize]))
                .collect()
        };
        let nodes = 0..self.mesh.nodes.len();
        let mut parted: Vec<u32> = nodes.into_par_iter().flat_map_iter(leaving).collect();
        parted.sort_unstable();
        parted.dedup();
        parted.iter().for_each(|&tet| labels[tet as usize] = 0);
        parted.len()
    }

    /// The tetrahedra around a node.
    pub(super) fn tets_of(&self, node: usize) -> &[u32] {
        &self.tets_of[self.start[node] as usize..self.start[node + 1] as usize]
    }

    /// The grains at a node and how many of its tetrahedra each has.
    pub(super) fn claims(&self, labels: &[u32], node: usize) -> Vec<(u32, u32)> {
        let mut claims: Vec<(u32, u32)> = Vec::new();
        for &tet in self.tets_of(node) {
            let label = labels[tet as usize];
            match claims.iter_mut().find(|(grain, _)| *grain == label) {
                _ if label == 0 => {}
                Some((_, count)) => *count += 1,
                None => claims.push((label, 1)),
            }
        }
        claims
    }

    /// Gives tetrahedra that three of their faces part from one other label to that label: they would
    /// lie flat on the interface. Repeats while that changes something, up to a few times.
    pub(super) fn drop_spikes(&self, labels: &mut [u32]) -> usize {
        let mut changed = 0;
        for _ in 0..SPIKE_PASSES {
            let spike = |tet: u32| {
                let own = labels[tet as usize];
                let beside = |(_, other): (u32, u32)| labels[other as usize];
                let mut others: Vec<u32> = self.around(tet).map(beside).collect();
                others.sort_unstable();
                let run = others.chunk_by(|a, b| a == b).find(|run| run.len() >= 3)?;
                (run[0] != own).then_some((tet, run[0]))
            };
            let tets = 0..labels.len() as u32;
            let spikes: Vec<(u32, u32)> = tets.into_par_iter().filter_map(spike).collect();
            changed += spikes.len();
            if spikes.is_empty() {
                break;
            }
            spikes.into_iter().for_each(|(tet, label)| labels[tet as usize] = label);
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::mesh::CylinderLattice;
    use crate::mesh::tet_mesh::Parts;

    /// The same by the classes of equal labels, found all at once.
    fn drop_small_components(labels: &mut [u32], faces: &[[u32; 2]], smallest: usize) -> usize {
        let mut changed = 0;
        for of_grain in [true, false] {
            let mut parts = Parts::new(labels.len());
            for &[a, b] in faces {
                if labels[a as usize] == labels[b as usize] {
                    parts.join(a, b);
                }
            }
            let roots: Vec<u32> = (0..labels.len() as u32).map(|tet| parts.root(tet)).collect();
            let mut size: BTreeMap<u32, usize> = BTreeMap::new();
            roots.iter().for_each(|&root| *size.entry(root).or_default() += 1);
            let mut around: BTreeMap<u32, u32> = BTreeMap::new();
            for &[a, b] in faces {
                for (tet, other) in [(a, b), (b, a)] {
                    let (label, beside) = (labels[tet as usize], labels[other as usize]);
                    let root = roots[tet as usize];
                    if label != beside && size[&root] < smallest && (label > 0) == of_grain {
                        around.insert(root, if of_grain { 0 } else { beside });
                    }
                }
            }
            for (label, root) in labels.iter_mut().zip(&roots) {
                if let Some(&new) = around.get(root) {
                    *label = new;
                    changed += 1;
                }
            }
        }
        changed
    }

    #[test]
    fn components_are_those_of_the_connected_classes() {
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 };
        let mesh = lattice.build().expect("a sound lattice");
        let faces = mesh.neighbours();
        let adjacency = Adjacency::new(&mesh, &faces);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for smallest in [0, 1, 2, 3, 7] {
            for grains in [1, 2, 5] {
                let mut labels: Vec<u32> = (0..mesh.tets.len())
                    .map(|_| if rng.random_bool(0.6) { rng.random_range(1..=grains) } else { 0 })
                    .collect();
                let mut expected = labels.clone();
                let changed = drop_small_components(&mut expected, &faces, smallest);
                assert_eq!(adjacency.drop_small_components(&mut labels, smallest), changed);
                assert_eq!(labels, expected);
                // no node belongs to two grains, and nothing changes a second time
                adjacency.separate_grains(&mut labels, |_, _| true);
                let mut grain_of = vec![0; mesh.nodes.len()];
                for (tet, &label) in mesh.tets.iter().zip(&labels).filter(|(_, label)| **label > 0)
                {
                    for &node in tet {
                        let grain = &mut grain_of[node as usize];
                        assert!(*grain == 0 || *grain == label, "node {node} is shared");
                        *grain = label;
                    }
                }
                assert_eq!(adjacency.separate_grains(&mut labels, |_, _| true), 0);
            }
        }
    }
}
