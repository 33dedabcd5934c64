//! Finite-element space on a mesh: nodes, connectivity, shape gradients.

use std::collections::{BTreeMap, BTreeSet};

use super::geometry::Geometry;
use super::rule::{DamageRule, Rule, mean_values};
use super::tetrahedron::Tetrahedron;
use crate::parallel::Part;
use fem_mesh::TetMesh;

/// Lagrange space of equal order for displacement and damage, with `N` nodes per element.
#[derive(Clone, Debug)]
pub struct Space<const N: usize> {
    /// Reference positions of the nodes, mm: the nodes of the mesh, then (for quadratic elements) the nodes on its
    /// edges.
    pub nodes: Vec<[f64; 3]>,
    /// Nodes of each element.
    pub tets: Vec<[u32; N]>,
    /// Region of each element.
    pub region: Vec<u16>,
    pub rule: Rule,
    /// Mean values ∫ N_a dV / V of the shape functions of a straight element.
    pub mean_value: [f64; N],
    /// Shape functions N_a(λ) of the element type.
    pub values: fn([f64; 4]) -> [f64; N],
    /// Derivatives ∂N_a/∂λ_k of the shape functions of the element type.
    pub slopes: fn([f64; 4]) -> [[f64; 4]; N],
    /// Node on each edge. The key of an edge consists of its two end nodes in increasing order.
    midpoints: BTreeMap<[u32; 2], u32>,
    /// Geometry of the elements: one entry per straight element, and one entry per elastic quadrature point of a curved
    /// element.
    geometry: Vec<Geometry<f64>>,
    /// CSR offsets of the elements into `geometry`; length `tets + 1`.
    first: Vec<u32>,
    /// Volume fraction of the second phase of each element; empty if there are no mixtures.
    fraction: Vec<f64>,
    /// Region of the second phase of each element; empty if there are no mixtures.
    second: Vec<u16>,
    /// Material of the interface band of each element, and the share of the element in the band; empty without bands.
    band: Vec<(u16, f64)>,
}

impl<const N: usize> Space<N> {
    /// Creates the space with element type `T` on a valid mesh. Curved edges of the mesh are used if the element type
    /// has nodes on edges.
    pub fn new<T: Tetrahedron<N>>(mesh: &TetMesh, damage: DamageRule) -> Self {
        let bent: BTreeMap<_, _> = mesh.edge_points.iter().copied().collect();
        let mut nodes = mesh.nodes.clone();
        let mut midpoints = BTreeMap::new();
        let mut tets = Vec::with_capacity(mesh.tets.len());
        let mut curved = vec![false; mesh.tets.len()];
        for (vertices, curved) in mesh.tets.iter().zip(&mut curved) {
            tets.push(std::array::from_fn(|a| match a.checked_sub(4) {
                None => vertices[a],
                Some(edge) => {
                    let [i, j] = T::EDGES[edge].map(|v| vertices[v]);
                    let point = bent.get(&edge_key(i, j));
                    *curved |= point.is_some();
                    *midpoints.entry(edge_key(i, j)).or_insert_with(|| {
                        let (p, q) = (mesh.nodes[i as usize], mesh.nodes[j as usize]);
                        let middle = || std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
                        nodes.push(point.copied().unwrap_or_else(middle));
                        (nodes.len() - 1) as u32
                    })
                }
            }));
        }
        let rule = Rule::new::<N, T>(damage);
        let mut geometry = Vec::with_capacity(tets.len());
        let mut first = vec![0];
        for (tet, curved) in tets.iter().zip(curved) {
            let x = tet.map(|node| nodes[node as usize]);
            let evaluated_points =
                if curved { &rule.elastic_points[..] } else { &rule.elastic_points[..1] };
            geometry.extend(evaluated_points.iter().map(|point| {
                if curved { Geometry::of(&x, &T::slopes(point.at)) } else { Geometry::straight(&x) }
            }));
            first.push(geometry.len() as u32);
        }
        // an element whose two phases are the same region is not a mixture
        let fraction = |(mixture, &region): (&fem_mesh::Mixture, &u16)| {
            if region != mixture.region { f64::from(mixture.fraction) } else { 0.0 }
        };
        let mixtures = || mesh.mixture.iter().flat_map(|all| all.iter().zip(&mesh.region_of));
        Self {
            nodes,
            tets,
            region: mesh.region_of.clone(),
            rule,
            mean_value: mean_values::<N, T>(),
            values: T::values,
            slopes: T::slopes,
            midpoints,
            geometry,
            first,
            fraction: mixtures().map(fraction).collect(),
            second: mixtures().map(|(mixture, _)| mixture.region).collect(),
            band: Vec::new(),
        }
    }

    /// Returns the space with interface bands: for each element the index of the band's material and the share of the
    /// element in the band. The list is empty without bands.
    pub fn with_bands(self, band: Vec<(u16, f64)>) -> Self {
        Self { band, ..self }
    }

    /// Returns the space on a part of the mesh, with the node numbers of the part.
    pub fn part(&self, part: &Part) -> Self {
        let local = part.local();
        let here =
            |tet: &[u32; N]| tet.map(|n| local(n).expect("a part has the nodes of its elements"));
        let (mut geometry, mut first) = (Vec::new(), vec![0]);
        for &tet in &part.tets {
            geometry.extend_from_slice(self.geometry(tet as usize));
            first.push(geometry.len() as u32);
        }
        let midpoint = |(ends, &middle): (&[u32; 2], &u32)| {
            let [i, j] = [local(ends[0])?, local(ends[1])?];
            Some((edge_key(i, j), local(middle)?))
        };
        Self {
            nodes: part.pick_nodes(&self.nodes),
            tets: part.tets.iter().map(|&tet| here(&self.tets[tet as usize])).collect(),
            region: part.pick_tets(&self.region, 1),
            rule: self.rule.clone(),
            midpoints: self.midpoints.iter().filter_map(midpoint).collect(),
            geometry,
            first,
            fraction: part.pick_tets(&self.fraction, 1),
            second: part.pick_tets(&self.second, 1),
            band: part.pick_tets(&self.band, 1),
            ..*self
        }
    }

    /// Returns the geometry of an element at its elastic points; a single entry if the element is straight.
    #[inline(always)]
    pub fn geometry(&self, tet: usize) -> &[Geometry<f64>] {
        &self.geometry[self.first[tet] as usize..self.first[tet + 1] as usize]
    }

    /// Returns whether an element has curved edges.
    #[inline(always)]
    pub fn is_curved(&self, tet: usize) -> bool {
        self.first[tet + 1] - self.first[tet] > 1
    }

    /// Returns the volume fraction of the second phase of an element.
    #[inline(always)]
    pub fn fraction(&self, tet: usize) -> f64 {
        self.fraction.get(tet).copied().unwrap_or(0.0)
    }

    /// Returns the region of the second phase of an element; the element's own region if there are no mixtures.
    #[inline(always)]
    pub fn second_region(&self, tet: usize) -> usize {
        usize::from(self.second.get(tet).copied().unwrap_or(self.region[tet]))
    }

    /// Returns the index of the material of an element's interface band, and the share of the element in the band; in a
    /// mixture, the share of the matrix in the band. The share is zero outside of bands.
    #[inline(always)]
    pub fn band(&self, tet: usize) -> (usize, f64) {
        self.band.get(tet).map_or((0, 0.0), |&(material, share)| (usize::from(material), share))
    }

    /// Returns whether any element is a mixture of two phases.
    pub fn has_mixtures(&self) -> bool {
        self.fraction.iter().any(|&fraction| fraction > 0.0)
    }

    /// Returns the volume of an element, mm³, integrated with the elastic points.
    pub fn volume(&self, tet: usize) -> f64 {
        match self.geometry(tet) {
            [one] => one.volume,
            geometries => geometries
                .iter()
                .zip(&self.rule.elastic_points)
                .map(|(g, q)| q.weight * g.volume)
                .sum(),
        }
    }

    /// Returns the nodes on a set of triangles, in increasing order.
    pub fn nodes_on(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let mut on = BTreeSet::new();
        for &[a, b, c] in triangles {
            on.extend([a, b, c]);
            for (i, j) in [(a, b), (b, c), (c, a)] {
                on.extend(self.midpoint(i, j));
            }
        }
        on.into_iter().collect()
    }

    /// Returns the node on the edge between nodes i and j; `None` for linear elements.
    pub fn midpoint(&self, i: u32, j: u32) -> Option<u32> {
        self.midpoints.get(&edge_key(i, j)).copied()
    }
}

/// Returns the end nodes of an edge in increasing order.
fn edge_key(i: u32, j: u32) -> [u32; 2] {
    [i.min(j), i.max(j)]
}
