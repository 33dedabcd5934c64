//! Integrals over a finite-element space and over its surfaces.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::geometry::Geometry;
use super::quadrature::{QuadraturePoint, fourteen};
use super::rule::Rule;
use super::space::Space;
use super::triangle::seven;
use crate::fields::Fields;

/// Tolerance of the test whether a point is inside an element: every barycentric coordinate must be at least
/// −`OUTSIDE`.
const OUTSIDE: f64 = 1e-6;
/// Largest number of iterations that compute the barycentric coordinates of a point in an element.
const POINT_ITERATIONS: u32 = 50;
/// The iterations have converged when the computed point is closer to the given point than this distance, relative to
/// the element size.
const POINT_TOLERANCE: f64 = 1e-11;

/// Values of the fields at a point inside the body.
#[derive(Clone, Copy, Debug)]
pub struct PointValues {
    /// Reference position, mm.
    pub position_mm: [f64; 3],
    /// Index of the region.
    pub region: usize,
    /// Displacement u, mm.
    pub displacement_mm: [f64; 3],
    /// Displacement gradient ∂u_i/∂X_j; row i, column j.
    pub displacement_gradient: [[f64; 3]; 3],
    /// Damage φ.
    pub damage: f64,
    /// Damage gradient ∂φ/∂X_j, 1/mm.
    pub damage_gradient_per_mm: [f64; 3],
}

/// Finite-element space without its element type, for boundary conditions, solvers and results.
pub trait Domain {
    /// Returns the number of elements.
    fn tets(&self) -> usize;

    /// Returns the nodes of an element: its vertices, then the nodes on its edges.
    fn nodes_of(&self, tet: usize) -> &[u32];

    /// Returns whether an element is *plain*: straight, not a mixture of two phases, and without tangent terms
    /// of viscoelastic and plastic laws. The tangent of a plain element needs less storage.
    fn is_plain(&self, tet: usize) -> bool;

    /// Returns the integration rule of all elements.
    fn rule(&self) -> &Rule;

    /// Returns the number of elastic quadrature points of all elements.
    fn elastic_points(&self) -> usize {
        self.tets() * self.rule().elastic_points.len()
    }

    /// Returns the integral of a nodal field over the regions whose entry in `regions` is true, and the volume (mm³) of
    /// these regions. An element that is a mixture contributes only its matrix fraction.
    fn integral(&self, field: &[f64], regions: &[bool]) -> [f64; 2];

    /// Returns the reference positions of all nodes, mm.
    fn nodes(&self) -> &[[f64; 3]];

    /// Returns the nodes on triangles of the mesh, in increasing order.
    fn nodes_on(&self, triangles: &[[u32; 3]]) -> Vec<u32>;

    /// Adds the nodal load ∫ N_a f dV (N), integrated over the elements of the regions for which `acts` is true, to
    /// the entry of node a in `out`. `density` is f as a function of the reference position, mm.
    fn volume_load(
        &self,
        acts: &dyn Fn(usize) -> bool,
        density: &dyn Fn([f64; 3]) -> [f64; 4],
        out: &mut [[f64; 4]],
    );

    /// Returns the nodes of a face: its vertices, then for quadratic elements the nodes on its edges 01, 12, 20.
    fn face_nodes(&self, triangle: &[u32; 3]) -> Vec<u32>;

    /// Adds the nodal load ∫ N_a t dA (N), integrated over triangles, to the entry of node a in `out`. `traction` is
    /// t (MPa) as a function of the reference position, mm.
    fn surface_load(
        &self,
        triangles: &[[u32; 3]],
        traction: &dyn Fn([f64; 3]) -> [f64; 3],
        out: &mut [[f64; 4]],
    );

    /// Returns the resultant ∫ t dA (N) of the traction t (MPa) on triangles.
    fn surface_resultant(
        &self,
        triangles: &[[u32; 3]],
        traction: &dyn Fn([f64; 3]) -> [f64; 3],
    ) -> [f64; 3];

    /// Returns ∫ N_a dA for the nodes on triangles, mm². Nodes with zero area (the vertices of quadratic triangles)
    /// are omitted.
    fn nodal_areas(&self, triangles: &[[u32; 3]]) -> Vec<(u32, f64)>;

    /// Returns the nodes of the element that contains a reference position (mm), and the values of their shape
    /// functions there; `None` outside the body.
    fn interpolation(&self, position: [f64; 3]) -> Option<Vec<(u32, f64)>>;

    /// Calls `each` at each point of a quadrature rule of degree 5, with the field values at the point and the
    /// volume (mm³) that the point represents.
    fn visit(&self, fields: &Fields, each: &mut dyn FnMut(&PointValues, f64));
}

/// Quadrature point on a face of the body.
struct FacePoint {
    position: [f64; 3],
    /// Values N_a of the shape functions of the face's nodes.
    values: [f64; 6],
    /// Weight of the point in integrals over the face, mm².
    area: f64,
}

impl<const N: usize> Space<N> {
    /// Returns the nodes of a face: its vertices, then for quadratic elements the nodes on its edges 01, 12, 20.
    fn face(&self, triangle: &[u32; 3]) -> Vec<u32> {
        let [a, b, c] = *triangle;
        let on_edges = [(a, b), (b, c), (c, a)].map(|(i, j)| self.midpoint(i, j));
        triangle.iter().copied().chain(on_edges.into_iter().flatten()).collect()
    }

    /// Returns the points of a quadrature rule of degree 5 on a face. The shape functions of the face equal the shape
    /// functions of a tetrahedron on the face λ₃ = 0.
    fn face_points(&self, nodes: &[u32]) -> [FacePoint; 7] {
        let of_tet = |a: usize| if a < 3 { a } else { a + 1 };
        seven().map(|(at, weight)| {
            let at = [at[0], at[1], at[2], 0.0];
            let (all, slopes) = ((self.values)(at), (self.slopes)(at));
            let (mut position, mut values) = ([0.0; 3], [0.0; 6]);
            let mut along = [Vector3::zeros(); 2];
            for (a, &node) in nodes.iter().enumerate() {
                let (x, s) = (self.nodes[node as usize], slopes[of_tet(a)]);
                values[a] = all[of_tet(a)];
                (0..3).for_each(|k| position[k] += values[a] * x[k]);
                for k in 0..2 {
                    along[k] += Vector3::from(x) * (s[k + 1] - s[0]);
                }
            }
            let area = weight * 0.5 * along[0].cross(&along[1]).norm();
            FacePoint { position, values, area }
        })
    }

    /// Returns the points of a quadrature rule of degree 5 on an element, each with the values N_a and the derivatives
    /// ∂N_a/∂λ_k of the shape functions.
    fn fine_rule(&self) -> Vec<(QuadraturePoint, [f64; N], [[f64; 4]; N])> {
        let values = |q: QuadraturePoint| (q, (self.values)(q.at), (self.slopes)(q.at));
        fourteen().into_iter().map(values).collect()
    }

    fn positions(&self, tet: usize) -> [[f64; 3]; N] {
        self.tets[tet].map(|node| self.nodes[node as usize])
    }

    /// Returns the barycentric coordinates of a reference position in an element. `None` if the iteration does not
    /// converge, because the position is far outside a curved element.
    fn barycentric(&self, tet: usize, position: [f64; 3]) -> Option<[f64; 4]> {
        let x = self.positions(tet);
        let edge = |k: usize| Vector3::from(x[k]) - Vector3::from(x[0]);
        let edges = Matrix3::from_columns(&[edge(1), edge(2), edge(3)]);
        let (inverse, size) = (edges.try_inverse()?, edges.norm());
        let mut at = [1.0, 0.0, 0.0, 0.0];
        // the iteration uses the inverse map of the straight element, which is exact for straight elements; curved
        // elements need a few iterations
        for _ in 0..POINT_ITERATIONS {
            let off = Vector3::from(position) - Vector3::from(mix(&x, &(self.values)(at)));
            if off.norm() <= POINT_TOLERANCE * size {
                return Some(at);
            }
            let step = inverse * off;
            at[0] -= step.sum();
            (0..3).for_each(|k| at[k + 1] += step[k]);
        }
        None
    }
}

/// Returns the sum of `points`, weighted by `weights`.
fn mix<const K: usize>(positions: &[[f64; 3]; K], weights: &[f64; K]) -> [f64; 3] {
    std::array::from_fn(|k| positions.iter().zip(weights).map(|(x, w)| w * x[k]).sum())
}

impl<const N: usize> Domain for Space<N> {
    fn tets(&self) -> usize {
        self.tets.len()
    }

    fn nodes_of(&self, tet: usize) -> &[u32] {
        &self.tets[tet]
    }

    fn is_plain(&self, tet: usize) -> bool {
        !self.is_curved(tet) && self.fraction(tet) == 0.0 && !self.rule.extra.stored
    }

    fn rule(&self) -> &Rule {
        &self.rule
    }

    fn integral(&self, field: &[f64], regions: &[bool]) -> [f64; 2] {
        let (mut integral, mut volume) = (0.0, 0.0);
        for (tet, nodes) in self.tets.iter().enumerate() {
            if regions[usize::from(self.region[tet])] {
                let values = nodes.iter().map(|&n| field[n as usize]);
                let mean: f64 = values.zip(self.mean_value).map(|(x, share)| share * x).sum();
                let matrix = (1.0 - self.fraction(tet)) * self.volume(tet);
                integral += matrix * mean;
                volume += matrix;
            }
        }
        [integral, volume]
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
        let rule = self.fine_rule();
        for tet in (0..self.tets.len()).filter(|&tet| acts(usize::from(self.region[tet]))) {
            let x = self.positions(tet);
            for (q, values, slopes) in &rule {
                let f = density(mix(&x, values));
                let weight = q.weight * Geometry::of(&x, slopes).volume;
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
            let nodes = self.face(triangle);
            for point in self.face_points(&nodes) {
                let t = traction(point.position);
                for (&node, value) in nodes.iter().zip(point.values) {
                    for k in 0..3 {
                        out[node as usize][k] += point.area * value * t[k];
                    }
                }
            }
        }
    }

    fn face_nodes(&self, triangle: &[u32; 3]) -> Vec<u32> {
        self.face(triangle)
    }

    fn surface_resultant(
        &self,
        triangles: &[[u32; 3]],
        traction: &dyn Fn([f64; 3]) -> [f64; 3],
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for triangle in triangles {
            for point in self.face_points(&self.face(triangle)) {
                let t = traction(point.position);
                (0..3).for_each(|k| sum[k] += point.area * t[k]);
            }
        }
        sum
    }

    fn nodal_areas(&self, triangles: &[[u32; 3]]) -> Vec<(u32, f64)> {
        let mut areas = BTreeMap::new();
        for triangle in triangles {
            let nodes = self.face(triangle);
            let area: f64 = self.face_points(&nodes).iter().map(|point| point.area).sum();
            for &node in &nodes[nodes.len() - 3..] {
                *areas.entry(node).or_insert(0.0) += area / 3.0;
            }
        }
        areas.into_iter().collect()
    }

    fn interpolation(&self, position: [f64; 3]) -> Option<Vec<(u32, f64)>> {
        let least = |at: &[f64; 4]| at.iter().copied().fold(f64::INFINITY, f64::min);
        let (tet, at) = (0..self.tets.len())
            .filter_map(|tet| Some((tet, self.barycentric(tet, position)?)))
            .max_by(|(_, a), (_, b)| least(a).total_cmp(&least(b)))
            .filter(|(_, at)| least(at) >= -OUTSIDE)?;
        Some(self.tets[tet].iter().copied().zip((self.values)(at)).collect())
    }

    fn visit(&self, fields: &Fields, each: &mut dyn FnMut(&PointValues, f64)) {
        let rule = self.fine_rule();
        for (tet, nodes) in self.tets.iter().enumerate() {
            let x = self.positions(tet);
            for (q, values, slopes) in &rule {
                let Geometry { barycentric, volume } = Geometry::of(&x, slopes);
                let mut point = PointValues {
                    position_mm: mix(&x, values),
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
                        let along =
                            |k: usize| (slopes[a][k + 1] - slopes[a][0]) * barycentric[k][j];
                        (0..3).map(along).sum()
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
                each(&point, q.weight * volume);
            }
        }
    }
}
