//! A finite-element space on a mesh: nodes, connectivity, shape gradients.

use std::collections::{BTreeMap, BTreeSet};

use super::rule::{DamageRule, Rule, mean_values};
use super::tetrahedron::Tetrahedron;
use crate::mesh::TetMesh;

/// Equal-order Lagrange space for displacement and damage; `N` nodes an element.
#[derive(Clone, Debug)]
pub(crate) struct Space<const N: usize> {
    /// Reference positions, mm: the mesh's nodes, then the midpoints of its edges (P2).
    pub(crate) nodes: Vec<[f64; 3]>,
    pub(crate) tets: Vec<[u32; N]>,
    pub(crate) region: Vec<u16>,
    /// mm³.
    pub(crate) volume: Vec<f64>,
    /// ∇λ_k for k = 1 … 3 of each element, 1/mm.
    pub(crate) barycentric: Vec<[[f64; 3]; 3]>,
    pub(crate) rule: Rule,
    /// ∫ N_a dV / V of an element.
    pub(crate) mean_value: [f64; N],
    /// N_a(λ) of the element type.
    pub(crate) values: fn([f64; 4]) -> [f64; N],
    /// ∂N_a/∂λ_k of the element type.
    pub(crate) slopes: fn([f64; 4]) -> [[f64; 4]; N],
    midpoints: BTreeMap<[u32; 2], u32>,
}

impl<const N: usize> Space<N> {
    /// Raises a sound mesh to element type `T`.
    pub(crate) fn new<T: Tetrahedron<N>>(mesh: &TetMesh, damage: DamageRule) -> Self {
        let mut nodes = mesh.nodes.clone();
        let mut midpoints = BTreeMap::new();
        let mut tets = Vec::with_capacity(mesh.tets.len());
        for vertices in &mesh.tets {
            tets.push(std::array::from_fn(|a| match a.checked_sub(4) {
                None => vertices[a],
                Some(edge) => {
                    let [i, j] = T::EDGES[edge].map(|v| vertices[v]);
                    *midpoints.entry(edge_key(i, j)).or_insert_with(|| {
                        let (p, q) = (mesh.nodes[i as usize], mesh.nodes[j as usize]);
                        nodes.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
                        (nodes.len() - 1) as u32
                    })
                }
            }));
        }
        let (volume, barycentric) = mesh
            .tets
            .iter()
            .map(|vertices| {
                let (volume, [_, x, y, z]) =
                    barycentric_gradients(vertices.map(|v| mesh.nodes[v as usize]));
                (volume, [x, y, z])
            })
            .unzip();
        Self {
            nodes,
            tets,
            region: mesh.region_of.clone(),
            volume,
            barycentric,
            rule: Rule::new::<N, T>(damage),
            mean_value: mean_values::<N, T>(),
            values: T::values,
            slopes: T::slopes,
            midpoints,
        }
    }

    /// The nodes on a set of triangles, in increasing order.
    pub(crate) fn nodes_on(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let mut on = BTreeSet::new();
        for &[a, b, c] in triangles {
            on.extend([a, b, c]);
            for (i, j) in [(a, b), (b, c), (c, a)] {
                on.extend(self.midpoints.get(&edge_key(i, j)));
            }
        }
        on.into_iter().collect()
    }

    /// The node in the middle of an edge, if the elements have one.
    pub(crate) fn midpoint(&self, i: u32, j: u32) -> Option<u32> {
        self.midpoints.get(&edge_key(i, j)).copied()
    }
}

fn edge_key(i: u32, j: u32) -> [u32; 2] {
    [i.min(j), i.max(j)]
}

/// Signed volume and ∇λ_k of a tetrahedron.
pub(crate) fn barycentric_gradients(x: [[f64; 3]; 4]) -> (f64, [[f64; 3]; 4]) {
    let edge = |k: usize| nalgebra::Vector3::from(x[k]) - nalgebra::Vector3::from(x[0]);
    let (a, b, c) = (edge(1), edge(2), edge(3));
    let six_volumes = a.dot(&b.cross(&c));
    let rows = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|r| r / six_volumes);
    let first = -(rows[0] + rows[1] + rows[2]);
    (six_volumes / 6.0, [first.into(), rows[0].into(), rows[1].into(), rows[2].into()])
}
