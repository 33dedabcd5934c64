//! Pressure on surfaces: dead, or normal to the deformed surface (follower).
//!
//! A face with the shape functions N_a and the positions x(ξ, η) has the force f_a = −∫ p N_a (x,ξ × x,η) dξ dη at node
//! a, with the pressure p. A dead pressure uses the reference positions. A follower pressure uses the deformed
//! positions; its *load stiffness* −∂f_a/∂u_b couples the nodes of the face, and is not symmetric for a surface with a
//! boundary.
//!
//! Reference: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed. (2008),
//! doi:10.1017/CBO9780511755446, section 8.5.

use std::sync::Arc;

use nalgebra::Vector3;

use super::function::Function;
use crate::element::{Domain, seven};
use crate::fields::Fields;
use crate::operator::PairBlock;

/// Pressure on a surface of the body.
#[derive(Clone, Debug)]
pub(crate) struct Pressure {
    pub(super) surface: String,
    /// Faces of the surface. A valid mesh has faces whose normals (right-hand rule) point out of the body.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Pressure, MPa.
    pub(super) pressure: Function<f64>,
    /// Whether the pressure is normal to the deformed surface.
    pub(super) follows: bool,
}

/// Follower pressure on a surface at one time.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    pub(super) surface: String,
    faces: Arc<[Face]>,
}

/// Face with the pressure at its quadrature points.
#[derive(Clone, Debug)]
struct Face {
    /// Nodes: three vertices, for quadratic elements followed by the nodes of the edges 01, 12, 20.
    nodes: Vec<u32>,
    /// Reference positions of the nodes, mm.
    positions: Vec<Vector3<f64>>,
    /// Pressure at the points of the rule, MPa.
    pressure: [f64; 7],
}

/// Values and derivatives of the shape functions of a face at a quadrature point.
struct ShapeValues {
    values: [f64; 6],
    by_xi: [f64; 6],
    by_eta: [f64; 6],
}

impl Pressure {
    /// Adds the nodal forces of the pressure on the reference surface at a time to `nodal`, N. Returns the resultant force,
    /// N.
    pub(super) fn add_dead(
        &self,
        domain: &dyn Domain,
        time_s: f64,
        nodal: &mut [[f64; 4]],
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for face in self.faces(domain, time_s) {
            for (&node, force) in face.nodes.iter().zip(face.forces(&face.positions)) {
                for k in 0..3 {
                    nodal[node as usize][k] += force[k];
                    sum[k] += force[k];
                }
            }
        }
        sum
    }

    /// Returns the follower pressure at a time.
    pub(super) fn follower(&self, domain: &dyn Domain, time_s: f64) -> Follower {
        Follower { surface: self.surface.clone(), faces: self.faces(domain, time_s).collect() }
    }

    fn faces<'a>(&'a self, domain: &'a dyn Domain, time_s: f64) -> impl Iterator<Item = Face> + 'a {
        self.triangles.iter().map(move |triangle| {
            let nodes = domain.face_nodes(triangle);
            let position = |&node: &u32| Vector3::from(domain.nodes()[node as usize]);
            let positions: Vec<_> = nodes.iter().map(position).collect();
            let pressure = seven().map(|(at, _)| {
                let shape = ShapeValues::at(nodes.len(), at);
                let x = weighted(&positions, &shape.values);
                self.pressure.at(x.into(), time_s)
            });
            Face { nodes, positions, pressure }
        })
    }
}

impl Follower {
    /// Calls `each` with every node and its force at the fields, N; a node may occur several times.
    pub(super) fn forces(&self, fields: &Fields, each: &mut dyn FnMut(u32, [f64; 3])) {
        for face in self.faces.iter() {
            for (&node, force) in face.nodes.iter().zip(face.forces(&face.deformed(fields))) {
                each(node, force.into());
            }
        }
    }

    /// Adds the load stiffness at the fields.
    pub(super) fn add_tangent(&self, fields: &Fields, out: &mut Vec<PairBlock>) {
        self.faces.iter().for_each(|face| face.add_tangent(&face.deformed(fields), out));
    }

    /// Whether all pressures are finite.
    pub(super) fn is_finite(&self) -> bool {
        self.faces.iter().flat_map(|face| &face.pressure).all(|p| p.is_finite())
    }
}

impl Face {
    fn deformed(&self, fields: &Fields) -> Vec<Vector3<f64>> {
        let nodes = self.nodes.iter().zip(&self.positions);
        nodes.map(|(&n, x)| x + Vector3::from(fields.displacement[n as usize])).collect()
    }

    /// Returns the force at each node for the positions `x` of the nodes, N.
    fn forces(&self, x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut forces = vec![Vector3::zeros(); x.len()];
        for ((at, weight), pressure) in seven().into_iter().zip(self.pressure) {
            let shape = ShapeValues::at(x.len(), at);
            let area = weighted(x, &shape.by_xi).cross(&weighted(x, &shape.by_eta));
            for (force, value) in forces.iter_mut().zip(shape.values) {
                *force -= area * (0.5 * weight * pressure * value);
            }
        }
        forces
    }

    /// Adds −∂f_a/∂u_b for the positions `x` of the nodes, N/mm.
    fn add_tangent(&self, x: &[Vector3<f64>], out: &mut Vec<PairBlock>) {
        let count = x.len();
        let mut blocks = vec![[[0.0; 3]; 3]; count * count];
        for ((at, weight), pressure) in seven().into_iter().zip(self.pressure) {
            let shape = ShapeValues::at(count, at);
            let (along_xi, along_eta) = (weighted(x, &shape.by_xi), weighted(x, &shape.by_eta));
            for b in 0..count {
                // a displacement e of node b changes x,ξ × x,η by e × w
                let w = along_eta * shape.by_xi[b] - along_xi * shape.by_eta[b];
                let crossed = [[0.0, w[2], -w[1]], [-w[2], 0.0, w[0]], [w[1], -w[0], 0.0]];
                for a in 0..count {
                    let factor = 0.5 * weight * pressure * shape.values[a];
                    let block = &mut blocks[a * count + b];
                    for i in 0..3 {
                        for j in 0..3 {
                            block[i][j] += factor * crossed[i][j];
                        }
                    }
                }
            }
        }
        for (k, block) in blocks.into_iter().enumerate() {
            out.push((self.nodes[k / count], self.nodes[k % count], block));
        }
    }
}

impl ShapeValues {
    /// Shape functions of a face with three or six nodes at the barycentric coordinates `l`.
    fn at(nodes: usize, l: [f64; 3]) -> Self {
        let (dxi, deta) = ([-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]);
        let mut shape = Self { values: [0.0; 6], by_xi: [0.0; 6], by_eta: [0.0; 6] };
        for i in 0..3 {
            if nodes == 3 {
                (shape.values[i], shape.by_xi[i], shape.by_eta[i]) = (l[i], dxi[i], deta[i]);
                continue;
            }
            let j = (i + 1) % 3;
            let slope = 4.0 * l[i] - 1.0;
            shape.values[i] = l[i] * (2.0 * l[i] - 1.0);
            (shape.by_xi[i], shape.by_eta[i]) = (slope * dxi[i], slope * deta[i]);
            shape.values[3 + i] = 4.0 * l[i] * l[j];
            shape.by_xi[3 + i] = 4.0 * (dxi[i] * l[j] + l[i] * dxi[j]);
            shape.by_eta[3 + i] = 4.0 * (deta[i] * l[j] + l[i] * deta[j]);
        }
        shape
    }
}

fn weighted(vectors: &[Vector3<f64>], weights: &[f64; 6]) -> Vector3<f64> {
    vectors.iter().zip(weights).map(|(v, w)| v * *w).sum()
}

#[cfg(test)]
#[path = "../../tests/unit/pressure.rs"]
mod tests;
