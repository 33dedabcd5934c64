//! Integrals over a finite-element space and over surfaces of it.

use std::collections::BTreeMap;

use super::quadrature::fourteen;
use super::rule::Rule;
use super::space::{Space, barycentric_gradients};
use super::triangle::seven;
use crate::fields::Fields;

/// The fields at a point inside the body.
#[derive(Clone, Copy, Debug)]
pub struct PointValues {
    /// Reference position, mm.
    pub position_mm: [f64; 3],
    /// Number of the region.
    pub region: usize,
    /// u, mm.
    pub displacement_mm: [f64; 3],
    /// ∂u_i/∂X_j.
    pub displacement_gradient: [[f64; 3]; 3],
    /// φ.
    pub damage: f64,
    /// ∂φ/∂X_j, 1/mm.
    pub damage_gradient_per_mm: [f64; 3],
}

/// The geometry of a problem, whatever the element: what boundary conditions, solvers and results
/// need to know of a space.
pub(crate) trait Domain {
    /// Number of elements.
    fn tets(&self) -> usize;

    /// The nodes of one element: its vertices, then the midpoints of its edges.
    fn nodes_of(&self, tet: usize) -> &[u32];

    /// The integration rule of every element.
    fn rule(&self) -> &Rule;

    /// Number of elastic points.
    fn points(&self) -> usize {
        self.tets() * self.rule().points.len()
    }

    /// Volume-weighted mean of a nodal field over the elements whose region is marked.
    fn mean(&self, field: &[f64], regions: &[bool]) -> f64;

    /// Reference positions of all nodes, mm.
    fn nodes(&self) -> &[[f64; 3]];

    /// The nodes on triangles of the mesh, in increasing order.
    fn nodes_on(&self, triangles: &[[u32; 3]]) -> Vec<u32>;

    /// Adds ∫ N_a f dV over the elements for which `acts` holds (by region).
    fn volume_load(
        &self,
        acts: &dyn Fn(usize) -> bool,
        density: &dyn Fn([f64; 3]) -> [f64; 4],
        out: &mut [[f64; 4]],
    );

    /// Adds ∫ N_a t dA over triangles.
    fn surface_load(
        &self,
        triangles: &[[u32; 3]],
        traction: &dyn Fn([f64; 3]) -> [f64; 3],
        out: &mut [[f64; 4]],
    );

    /// ∫ N_a dA of the nodes on triangles, mm²; nodes without a share (the corners of quadratic
    /// triangles) are left out.
    fn nodal_areas(&self, triangles: &[[u32; 3]]) -> Vec<(u32, f64)>;

    /// Calls `each` with the values and the volume (mm³) of the points of a rule of degree 5.
    fn visit(&self, fields: &Fields, each: &mut dyn FnMut(&PointValues, f64));
}

impl<const N: usize> Space<N> {
    /// The nodes of a face: its corners, then the midpoints of its edges 01, 12, 20 (P2).
    fn face(&self, triangle: &[u32; 3]) -> ([u32; 6], usize) {
        let [a, b, c] = *triangle;
        let mut nodes = [a, b, c, 0, 0, 0];
        let mut count = 3;
        for (i, j) in [(a, b), (b, c), (c, a)] {
            if let Some(middle) = self.midpoint(i, j) {
                nodes[count] = middle;
                count += 1;
            }
        }
        (nodes, count)
    }

    /// N_a of a face's nodes: those of a tetrahedron on its face λ₃ = 0.
    fn face_values(&self, at: [f64; 3]) -> [f64; 6] {
        let all = (self.values)([at[0], at[1], at[2], 0.0]);
        std::array::from_fn(|k| match k.checked_sub(3) {
            None => all[k],
            Some(edge) => all.get(4 + edge).copied().unwrap_or(0.0),
        })
    }

    fn vertices(&self, tet: usize) -> [[f64; 3]; 4] {
        std::array::from_fn(|v| self.nodes[self.tets[tet][v] as usize])
    }
}

fn mix<const K: usize>(points: [[f64; 3]; K], weights: [f64; K]) -> [f64; 3] {
    std::array::from_fn(|k| points.iter().zip(weights).map(|(x, w)| w * x[k]).sum())
}

fn area(x: [[f64; 3]; 3]) -> f64 {
    let p = x.map(nalgebra::Vector3::from);
    0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).norm()
}

impl<const N: usize> Domain for Space<N> {
    fn tets(&self) -> usize {
        self.tets.len()
    }

    fn nodes_of(&self, tet: usize) -> &[u32] {
        &self.tets[tet]
    }

    fn rule(&self) -> &Rule {
        &self.rule
    }

    fn mean(&self, field: &[f64], regions: &[bool]) -> f64 {
        let (mut integral, mut volume) = (0.0, 0.0);
        for (tet, nodes) in self.tets.iter().enumerate() {
            if regions[usize::from(self.region[tet])] {
                let values = nodes.iter().map(|&n| field[n as usize]);
                let mean: f64 = values.zip(self.mean_value).map(|(x, share)| share * x).sum();
                integral += self.volume[tet] * mean;
                volume += self.volume[tet];
            }
        }
        if volume > 0.0 { integral / volume } else { 0.0 }
    }

    fn nodes(&self) -> &[[f64; 3]] {
        &self.nodes
    }

    fn nodes_on(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        Space::nodes_on(self, triangles)
    }

    fn volume_load(
        &self,
        acts: &dyn Fn(usize) -> bool,
        density: &dyn Fn([f64; 3]) -> [f64; 4],
        out: &mut [[f64; 4]],
    ) {
        let rule: Vec<_> = fourteen().into_iter().map(|q| ((self.values)(q.at), q)).collect();
        for tet in (0..self.tets.len()).filter(|&tet| acts(usize::from(self.region[tet]))) {
            let x = self.vertices(tet);
            for (values, q) in &rule {
                let f = density(mix(x, q.at));
                let weight = self.volume[tet] * q.weight;
                for (&node, value) in self.tets[tet].iter().zip(values) {
                    for k in 0..4 {
                        out[node as usize][k] += weight * value * f[k];
                    }
                }
            }
        }
    }

    fn surface_load(
        &self,
        triangles: &[[u32; 3]],
        traction: &dyn Fn([f64; 3]) -> [f64; 3],
        out: &mut [[f64; 4]],
    ) {
        for triangle in triangles {
            let corners = triangle.map(|n| self.nodes[n as usize]);
            let (nodes, count) = self.face(triangle);
            for (at, weight) in seven() {
                let t = traction(mix(corners, at));
                let values = self.face_values(at);
                for (&node, value) in nodes[..count].iter().zip(values) {
                    for k in 0..3 {
                        out[node as usize][k] += weight * area(corners) * value * t[k];
                    }
                }
            }
        }
    }

    fn nodal_areas(&self, triangles: &[[u32; 3]]) -> Vec<(u32, f64)> {
        let mut areas = BTreeMap::new();
        for triangle in triangles {
            let third = area(triangle.map(|n| self.nodes[n as usize])) / 3.0;
            let (nodes, count) = self.face(triangle);
            for &node in if count == 6 { &nodes[3..] } else { &nodes[..3] } {
                *areas.entry(node).or_insert(0.0) += third;
            }
        }
        areas.into_iter().collect()
    }

    fn visit(&self, fields: &Fields, each: &mut dyn FnMut(&PointValues, f64)) {
        let rule: Vec<_> =
            fourteen().into_iter().map(|q| ((self.values)(q.at), (self.slopes)(q.at), q)).collect();
        for (tet, nodes) in self.tets.iter().enumerate() {
            let x = self.vertices(tet);
            let (volume, barycentric) = barycentric_gradients(x);
            for (values, slopes, q) in &rule {
                let mut point = PointValues {
                    position_mm: mix(x, q.at),
                    region: usize::from(self.region[tet]),
                    displacement_mm: [0.0; 3],
                    displacement_gradient: [[0.0; 3]; 3],
                    damage: 0.0,
                    damage_gradient_per_mm: [0.0; 3],
                };
                for (a, &node) in nodes.iter().enumerate() {
                    let u = fields.displacement[node as usize];
                    let phi = fields.damage[node as usize];
                    let gradient: [f64; 3] = std::array::from_fn(|j| {
                        (0..4).map(|v| slopes[a][v] * barycentric[v][j]).sum()
                    });
                    point.damage += values[a] * phi;
                    for i in 0..3 {
                        point.displacement_mm[i] += values[a] * u[i];
                        point.damage_gradient_per_mm[i] += gradient[i] * phi;
                        for j in 0..3 {
                            point.displacement_gradient[i][j] += u[i] * gradient[j];
                        }
                    }
                }
                each(&point, volume * q.weight);
            }
        }
    }
}
