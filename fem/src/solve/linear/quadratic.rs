//! The level of quadratic elements above the linear ones: matrix-free, smoothed by Chebyshev
//! polynomials of the tangent with its diagonal.

use std::sync::Arc;

use super::chebyshev::{largest_eigenvalue, smooth};
use super::vector::{Nodal, add_scaled, mask};
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, NodeBlock, Operator, Product, Tangent};
use crate::parallel::Part;

pub(super) const DEGREE: usize = 3;

#[derive(Debug)]
pub(super) struct QuadraticLevel {
    matrix: FreeTangent,
    /// The vertices that each midpoint stands between; midpoints follow the vertices.
    parents: Arc<Vec<[u32; 2]>>,
    /// 1/|A_ii|, zero in constrained values.
    weight: Vec<Nodal>,
    /// Upper bound of the eigenvalues of the weighted tangent.
    largest: f64,
}

/// The tangent on the values that are not constrained.
#[derive(Debug)]
struct FreeTangent {
    product: Box<dyn Product>,
    /// What contact adds at nodes.
    contact: Vec<NodeBlock>,
    free: Vec<[bool; 4]>,
    part: Arc<Part>,
}

impl FreeTangent {
    /// y = A x on all values.
    fn multiply_whole(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.product.apply(x, y);
        self.part.halo.complete(y);
        for (node, block) in &self.contact {
            let (x, y) = (&x[*node as usize], &mut y[*node as usize]);
            for i in 0..3 {
                y[i] += (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
    }

    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.multiply_whole(x, y);
        mask(&self.free, y);
    }

    /// y ← y − A x.
    fn subtract(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        let mut product = vec![[0.0; 4]; x.len()];
        self.multiply(x, &mut product);
        add_scaled(y, -1.0, &product);
    }
}

fn scaled(weight: &Nodal, r: &Nodal) -> Nodal {
    std::array::from_fn(|k| weight[k] * r[k])
}

impl QuadraticLevel {
    /// A tangent of which `product` is what the elements of a part of the mesh give.
    pub(super) fn new(
        product: Box<dyn Product>,
        parents: Arc<Vec<[u32; 2]>>,
        part: Arc<Part>,
    ) -> Self {
        let matrix = FreeTangent { product, contact: Vec::new(), free: Vec::new(), part };
        Self { matrix, parents, weight: Vec::new(), largest: 1.0 }
    }

    pub(super) fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted> {
        self.matrix.contact = increment.context.contact.to_vec();
        self.matrix.free = free.to_vec();
        let sound = self.matrix.product.linearise(operator, increment, coupling);
        if self.matrix.part.ranks().any(sound.is_err()) { Err(Inverted) } else { Ok(()) }
    }

    /// The product, and what contact adds to it.
    pub(super) fn product(&mut self) -> &mut dyn Product {
        self.matrix.product.as_mut()
    }

    pub(super) fn contact(&self) -> &[NodeBlock] {
        &self.matrix.contact
    }

    pub(super) fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.matrix.multiply(x, y);
    }

    /// The same for all values, those that are constrained too.
    pub(super) fn multiply_whole(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.matrix.multiply_whole(x, y);
    }

    pub(super) fn diagonal(&mut self) -> Vec<Nodal> {
        let mut diagonal = self.matrix.product.diagonal();
        self.matrix.part.halo.complete(&mut diagonal);
        for (node, block) in &self.matrix.contact {
            (0..3).for_each(|k| diagonal[*node as usize][k] += block[k][k]);
        }
        diagonal
    }

    /// The tangent of the level below, or this rank's part of it.
    pub(super) fn add_linear(&mut self, out: &mut Tangent) {
        out.clear();
        self.matrix.product.add_linear(out);
        // a midpoint's values are the mean of its vertices'
        let vertices = out.pattern.graph.nodes();
        let halo = &self.matrix.part.halo;
        for (node, block) in self.matrix.contact.iter().filter(|(node, _)| halo.owns(*node)) {
            let ends = match (*node as usize).checked_sub(vertices) {
                None => vec![(*node, 1.0)],
                Some(midpoint) => self.parents[midpoint].map(|p| (p, 0.5)).to_vec(),
            };
            for &(a, share) in &ends {
                for &(b, other) in &ends {
                    let place = out.pattern.graph.place(a as usize, b);
                    for i in 0..3 {
                        for j in 0..3 {
                            out.blocks[place][i][j] += share * other * block[i][j];
                        }
                    }
                }
            }
        }
        out.symmetric = self.symmetric();
    }

    /// Whether contact on this rank leaves the tangent symmetric.
    pub(super) fn symmetric(&self) -> bool {
        let even = |b: &[[f64; 3]; 3]| (0..3).all(|i| (0..i).all(|j| b[i][j] == b[j][i]));
        self.matrix.contact.iter().all(|(_, block)| even(block))
    }

    /// Takes over the weights of the current diagonal and measures the largest eigenvalue.
    pub(super) fn renew(&mut self, weight: &[Nodal]) {
        self.weight = weight.to_vec();
        let matrix = &mut self.matrix;
        let halo = Arc::clone(&matrix.part.halo);
        let subtract = |x: &[Nodal], y: &mut [Nodal]| matrix.subtract(x, y);
        self.largest =
            largest_eigenvalue(&halo, weight.len(), subtract, |node, r| scaled(&weight[node], r));
    }

    /// z ≈ A⁻¹ r: smoothing, the level below, smoothing.
    pub(super) fn precondition(
        &mut self,
        r: &[Nodal],
        z: &mut [Nodal],
        below: impl FnOnce(&[Nodal], &mut [Nodal]),
    ) {
        let vertices = r.len() - self.parents.len();
        let mut residual = r.to_vec();
        z.fill([0.0; 4]);
        self.smooth(&mut residual, z);
        residual.copy_from_slice(r);
        self.matrix.subtract(z, &mut residual);
        // every node adds to the right-hand side on the rank that it belongs to
        let [own_vertices, own_midpoints] = match self.matrix.part.is_whole() {
            true => [0..vertices, vertices..r.len()],
            false => self.matrix.part.halo.own(r.len()),
        };
        let mut right = vec![[0.0; 4]; vertices];
        right[own_vertices.clone()].copy_from_slice(&residual[own_vertices]);
        let first = own_midpoints.start - vertices;
        for (parents, r) in self.parents[first..].iter().zip(&residual[own_midpoints]) {
            for &p in parents {
                (0..4).for_each(|k| right[p as usize][k] += 0.5 * r[k]);
            }
        }
        self.matrix.part.vertices.complete(&mut right);
        mask(&self.matrix.free[..vertices], &mut right);
        let mut correction = vec![[0.0; 4]; vertices];
        below(&right, &mut correction);
        let midpoint = |parents: &[u32; 2]| -> Nodal {
            let [a, b] = parents.map(|p| &correction[p as usize]);
            std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
        };
        let midpoints: Vec<Nodal> = self.parents.iter().map(midpoint).collect();
        correction.extend(midpoints);
        mask(&self.matrix.free, &mut correction);
        add_scaled(z, 1.0, &correction);
        residual.copy_from_slice(r);
        self.matrix.subtract(z, &mut residual);
        self.smooth(&mut residual, z);
    }

    fn smooth(&mut self, residual: &mut [Nodal], z: &mut [Nodal]) {
        let Self { matrix, weight, largest, .. } = self;
        let subtract = |x: &[Nodal], y: &mut [Nodal]| matrix.subtract(x, y);
        smooth(*largest, DEGREE, subtract, |node, r| scaled(&weight[node], r), residual, z);
    }
}
