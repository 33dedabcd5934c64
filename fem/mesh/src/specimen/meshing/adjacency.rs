//! Adjacency of tetrahedra, and correction of labels by the labels of adjacent tetrahedra.

use rayon::prelude::*;

use crate::mesh::TetMesh;
use crate::mesh::groups::Groups;

/// Adjacency of a mesh: the neighbours of each tetrahedron, and the tetrahedra of each node.
pub(super) struct Adjacency<'a> {
    mesh: &'a TetMesh,
    /// Inner faces. Each face is given by the pair of tetrahedra that share the face.
    faces: &'a [[u32; 2]],
    /// Inner faces of each tetrahedron, as indices into `faces`; [`NONE`] for a boundary face.
    faces_of: Vec<[u32; 4]>,
    /// Tetrahedra of each node.
    tets_of: Groups,
}

/// Largest number of passes over all tetrahedra in [`Adjacency::drop_spikes`].
const SPIKE_PASSES: usize = 4;
/// Placeholder in `faces_of` for a face on the boundary.
const NONE: u32 = u32::MAX;

impl<'a> Adjacency<'a> {
    /// Builds the adjacency; `faces` is the result of [`TetMesh::neighbours`].
    pub(super) fn new(mesh: &'a TetMesh, faces: &'a [[u32; 2]]) -> Self {
        let mut faces_of = vec![[NONE; 4]; mesh.tets.len()];
        for (face, tets) in faces.iter().enumerate() {
            for &tet in tets {
                let slots = &mut faces_of[tet as usize];
                let free = slots.iter().position(|&f| f == NONE).expect("four faces at most");
                slots[free] = face as u32;
            }
        }
        let corners = mesh.tets.as_flattened().iter().zip(0..);
        let pairs = corners.map(|(&node, corner): (&u32, u32)| (node, corner / 4));
        let tets_of = Groups::new(mesh.nodes.len(), pairs);
        Self { mesh, faces, faces_of, tets_of }
    }

    /// Iterates over the inner faces of a tetrahedron; each face comes with the tetrahedron on its other side.
    fn around(&self, tet: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.faces_of[tet as usize].iter().filter(|&&face| face != NONE).map(move |&face| {
            let [a, b] = self.faces[face as usize];
            (face, if a == tet { b } else { a })
        })
    }

    /// Returns the connected component of equal labels that contains `tet`, if it has fewer than `smallest`
    /// tetrahedra.
    fn component(&self, labels: &[u32], tet: u32, smallest: usize) -> Option<Vec<u32>> {
        let alike = |other: u32| labels[other as usize] == labels[tet as usize];
        // shortcut: most tetrahedra have so many neighbours of the same label that no search is needed
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

    /// Relabels connected components of a grain with fewer than `smallest` tetrahedra as matrix, and then components of
    /// matrix with fewer than `smallest` tetrahedra as an adjacent grain. Afterwards no small component is left,
    /// because each small component of matrix joins a grain that is large enough. Returns the number of changed labels.
    pub(super) fn drop_small_components(&self, labels: &mut [u32], smallest: usize) -> usize {
        let mut changed = 0;
        for of_grain in [true, false] {
            let change = |tet: u32| {
                let label = labels[tet as usize];
                if (label > 0) != of_grain {
                    return None;
                }
                let members = self.component(labels, tet, smallest)?;
                let faces = members.iter().flat_map(|&member| self.around(member));
                let outside = faces.filter(|&(_, other)| labels[other as usize] != label);
                // if several grains are adjacent, choose the grain behind the face with the largest index
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

    /// Separates pairs of grains that share nodes and for which `is_parted` returns `true`. At each node, grains are
    /// visited in decreasing order of their number of tetrahedra. A grain stays at the node if it need not be separated
    /// from any grain that was visited before and stays. Otherwise the grain's tetrahedra at the node become matrix.
    /// Returns the number of changed labels.
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
            // if two grains have the same number of tetrahedra, the smaller grain number comes first
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

    /// Returns the tetrahedra around a node.
    pub(super) fn tets_of(&self, node: usize) -> &[u32] {
        self.tets_of.of(node)
    }

    /// Returns the grains at a node, each with its number of tetrahedra at the node.
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

    /// Relabels each tetrahedron that has at least three faces in common with tetrahedra of one other label. Such a
    /// tetrahedron would become flat when its nodes move onto the interface. Passes are repeated until no label
    /// changes, but at most [`SPIKE_PASSES`] times. Returns the number of changed labels.
    pub(super) fn drop_spikes(&self, labels: &mut [u32]) -> usize {
        let mut changed = 0;
        for _ in 0..SPIKE_PASSES {
            let spike = |tet: u32| {
                let label = labels[tet as usize];
                let beside = |(_, other): (u32, u32)| labels[other as usize];
                let mut others: Vec<u32> = self.around(tet).map(beside).collect();
                others.sort_unstable();
                let run = others.chunk_by(|a, b| a == b).find(|run| run.len() >= 3)?;
                (run[0] != label).then_some((tet, run[0]))
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
    use fem_image::DisjointSets;

    /// Relabels small components like [`Adjacency::drop_small_components`], but computes all components at once by
    /// union–find.
    fn drop_small_components(labels: &mut [u32], faces: &[[u32; 2]], smallest: usize) -> usize {
        let mut changed = 0;
        for of_grain in [true, false] {
            let mut connected = DisjointSets::new(labels.len());
            for &[a, b] in faces {
                if labels[a as usize] == labels[b as usize] {
                    connected.join(a, b);
                }
            }
            let roots: Vec<u32> = (0..labels.len() as u32).map(|tet| connected.root(tet)).collect();
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
    fn relabelling_agrees_with_union_find() {
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
                // after the separation, no node belongs to two grains, and a second separation does not change any
                // label
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
