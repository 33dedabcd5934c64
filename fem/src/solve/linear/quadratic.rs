//! Multigrid level of quadratic elements above the linear level: matrix-free, with Chebyshev smoothing by the
//! diagonal of the tangent.

use std::sync::Arc;

use rayon::prelude::*;

use super::chebyshev::{largest_eigenvalue, smooth};
use super::vector::{CHUNK, Nodal, mask};
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, NodeBlock, Operator, Product, Tangent};
use crate::parallel::Part;

pub(super) const DEGREE: usize = 3;

#[derive(Debug)]
pub(super) struct QuadraticLevel {
    matrix: FreeTangent,
    /// The two vertices of the edge of each midpoint. Midpoints are numbered after the vertices.
    parents: Arc<Vec<[u32; 2]>>,
    /// Inverse of `parents`: offsets of each vertex into `children`, and the midpoints of each vertex in increasing
    /// order.
    first_child: Vec<u32>,
    children: Vec<u32>,
    /// 1/|A_ii|, zero in constrained values.
    weight: Vec<Nodal>,
    /// Upper bound of the eigenvalues of the weighted tangent.
    largest: f64,
    /// Work vectors, kept between calls because allocating them is slow.
    residual: Vec<Nodal>,
    step: Vec<Nodal>,
}

/// Tangent on the values that are not constrained.
#[derive(Debug)]
struct FreeTangent {
    product: Box<dyn Product>,
    /// Contributions of contact at nodes.
    contact: Vec<NodeBlock>,
    free: Vec<[bool; 4]>,
    part: Arc<Part>,
    /// Work vector for A x in `subtract`.
    product_of_x: Vec<Nodal>,
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
        let mut product = std::mem::take(&mut self.product_of_x);
        product.resize(x.len(), [0.0; 4]);
        self.multiply_whole(x, &mut product);
        let chunks = y.par_chunks_mut(CHUNK).zip(product.par_chunks(CHUNK));
        chunks.zip(self.free.par_chunks(CHUNK)).for_each(|((y, product), free)| {
            for ((y, product), free) in y.iter_mut().zip(product).zip(free) {
                for k in 0..4 {
                    y[k] -= if free[k] { product[k] } else { 0.0 };
                }
            }
        });
        self.product_of_x = product;
    }
}

fn scaled(weight: &Nodal, r: &Nodal) -> Nodal {
    std::array::from_fn(|k| weight[k] * r[k])
}

impl QuadraticLevel {
    /// Creates the level. `product` applies the tangent of the elements of this part of the mesh.
    pub(super) fn new(
        product: Box<dyn Product>,
        parents: Arc<Vec<[u32; 2]>>,
        part: Arc<Part>,
    ) -> Self {
        let (contact, free, product_of_x) = (Vec::new(), Vec::new(), Vec::new());
        let matrix = FreeTangent { product, contact, free, part, product_of_x };
        let (first_child, children) = children(&parents);
        Self {
            matrix,
            parents,
            first_child,
            children,
            weight: Vec::new(),
            largest: 1.0,
            residual: Vec::new(),
            step: Vec::new(),
        }
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

    /// Returns the product of the elements, without contact.
    pub(super) fn product(&mut self) -> &mut dyn Product {
        self.matrix.product.as_mut()
    }

    pub(super) fn contact(&self) -> &[NodeBlock] {
        &self.matrix.contact
    }

    pub(super) fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.matrix.multiply(x, y);
    }

    /// y = A x for all values, including constrained ones.
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

    /// Computes the tangent of the linear level, or this rank's part of it.
    pub(super) fn add_linear(&mut self, out: &mut Tangent) {
        out.clear();
        self.matrix.product.add_linear(out);
        // the values of a midpoint are the mean of the values of its two vertices
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

    /// Whether the contributions of contact on this rank are symmetric.
    pub(super) fn symmetric(&self) -> bool {
        let even = |b: &[[f64; 3]; 3]| (0..3).all(|i| (0..i).all(|j| b[i][j] == b[j][i]));
        self.matrix.contact.iter().all(|(_, block)| even(block))
    }

    /// Stores the weights of the current diagonal and computes the bound of the largest eigenvalue.
    pub(super) fn renew(&mut self, weight: &[Nodal]) {
        self.weight = weight.to_vec();
        let matrix = &mut self.matrix;
        let halo = Arc::clone(&matrix.part.halo);
        let subtract = |x: &[Nodal], y: &mut [Nodal]| matrix.subtract(x, y);
        self.largest =
            largest_eigenvalue(&halo, weight.len(), subtract, |node, r| scaled(&weight[node], r));
    }

    /// z ≈ A⁻¹ r: smoothing, correction by the level below, smoothing.
    pub(super) fn precondition(
        &mut self,
        r: &[Nodal],
        z: &mut [Nodal],
        below: impl FnOnce(&[Nodal], &mut [Nodal]),
    ) {
        let vertices = r.len() - self.parents.len();
        let mut residual = std::mem::take(&mut self.residual);
        residual.resize(r.len(), [0.0; 4]);
        copy(r, &mut residual);
        z.par_chunks_mut(CHUNK).for_each(|z| z.fill([0.0; 4]));
        self.smooth(&mut residual, z);
        copy(r, &mut residual);
        self.matrix.subtract(z, &mut residual);
        let right = self.restrict(&residual, vertices);
        let mut correction = vec![[0.0; 4]; vertices];
        below(&right, &mut correction);
        self.add_prolonged(&correction, z);
        copy(r, &mut residual);
        self.matrix.subtract(z, &mut residual);
        self.smooth(&mut residual, z);
        self.residual = residual;
    }

    /// Restricts a residual to the vertices: each vertex of an edge receives half of the midpoint's value.
    fn restrict(&self, residual: &[Nodal], vertices: usize) -> Vec<Nodal> {
        let part = &self.matrix.part;
        if !part.is_whole() {
            // each node contributes on the rank that owns it
            let [own_vertices, own_midpoints] = part.halo.own(residual.len());
            let mut right = vec![[0.0; 4]; vertices];
            right[own_vertices.clone()].copy_from_slice(&residual[own_vertices]);
            let first = own_midpoints.start - vertices;
            for (parents, r) in self.parents[first..].iter().zip(&residual[own_midpoints]) {
                for &p in parents {
                    (0..4).for_each(|k| right[p as usize][k] += 0.5 * r[k]);
                }
            }
            part.vertices.complete(&mut right);
            mask(&self.matrix.free[..vertices], &mut right);
            return right;
        }
        let (free, first, children) = (&self.matrix.free, &self.first_child, &self.children);
        let of_vertex = |vertex: usize| {
            let mut sum = residual[vertex];
            for &midpoint in &children[first[vertex] as usize..first[vertex + 1] as usize] {
                let r = &residual[vertices + midpoint as usize];
                (0..4).for_each(|k| sum[k] += 0.5 * r[k]);
            }
            (0..4).for_each(|k| sum[k] = if free[vertex][k] { sum[k] } else { 0.0 });
            sum
        };
        (0..vertices).into_par_iter().with_min_len(CHUNK).map(of_vertex).collect()
    }

    /// z ← z + P x; the value at a midpoint is the mean of its two vertices.
    fn add_prolonged(&self, x: &[Nodal], z: &mut [Nodal]) {
        let add = |z: &mut Nodal, free: &[bool; 4], x: Nodal| {
            (0..4).for_each(|k| z[k] += if free[k] { x[k] } else { 0.0 });
        };
        let (on_vertices, on_midpoints) = z.split_at_mut(x.len());
        let (of_vertices, of_midpoints) = self.matrix.free.split_at(x.len());
        let vertices = on_vertices.par_iter_mut().with_min_len(CHUNK).zip(of_vertices);
        vertices.zip(x).for_each(|((z, free), x)| add(z, free, *x));
        let midpoints = on_midpoints.par_iter_mut().with_min_len(CHUNK).zip(of_midpoints);
        midpoints.zip(&*self.parents).for_each(|((z, free), parents)| {
            let [a, b] = parents.map(|p| &x[p as usize]);
            add(z, free, std::array::from_fn(|k| 0.5 * (a[k] + b[k])));
        });
    }

    fn smooth(&mut self, residual: &mut [Nodal], z: &mut [Nodal]) {
        let Self { matrix, weight, largest, step, .. } = self;
        step.resize(z.len(), [0.0; 4]);
        let subtract = |x: &[Nodal], y: &mut [Nodal]| matrix.subtract(x, y);
        let scale = |node: usize, r: &Nodal| scaled(&weight[node], r);
        smooth(*largest, DEGREE, subtract, scale, [residual, step, z]);
    }
}

fn copy(from: &[Nodal], to: &mut [Nodal]) {
    let chunks = to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK));
    chunks.for_each(|(to, from)| to.copy_from_slice(from));
}

/// Returns the offsets of each vertex into the list of midpoints, and this list.
fn children(parents: &[[u32; 2]]) -> (Vec<u32>, Vec<u32>) {
    let vertices = parents.iter().flatten().max().map_or(0, |&v| v as usize + 1);
    let mut first = vec![0u32; vertices + 1];
    parents.iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
    (0..vertices).for_each(|v| first[v + 1] += first[v]);
    let mut next = first.clone();
    let mut children = vec![0u32; 2 * parents.len()];
    for (midpoint, ends) in parents.iter().enumerate() {
        for &v in ends {
            children[next[v as usize] as usize] = midpoint as u32;
            next[v as usize] += 1;
        }
    }
    (first, children)
}
