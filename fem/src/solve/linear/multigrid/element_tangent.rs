//! Matrix-free tangent of this rank's elements, of contact and of follower pressure, in the memory of this process. The file also has the
//! transfer between all nodes of quadratic elements and the vertices.

use std::sync::Arc;

use fem_mesh::Groups;
use rayon::prelude::*;

use super::super::in_memory::{CHUNK, Nodal, NodalVectors, mask};
use super::assembled::relax;
use super::chebyshev::Smoother;
use super::cycle::{FreeTangent, Level};
use super::matrix::{Grid, Matrix, Relaxation};
use crate::device::DeviceError;
use crate::material::Inverted;
use crate::operator::{
    Coupling, Increment, NodeBlock, Operator, PairBlock, Product, Tangent, add_pair_products,
};
use crate::parallel::Part;

/// Degree of the Chebyshev smoother of quadratic elements, on the processor and on devices.
pub(crate) const DEGREE: usize = 3;

/// Matrix-free tangent on the values that are not constrained.
#[derive(Debug)]
pub(crate) struct ElementTangent {
    product: Box<dyn Product>,
    /// Contributions of contact to the tangent, at the nodes in contact.
    contact: Vec<NodeBlock>,
    /// Contributions of forces that depend on the displacement of several nodes.
    pairs: Vec<PairBlock>,
    free: Vec<[bool; 4]>,
    /// Marks the values of the vertices that are free on the level of linear elements; see [`Self::free_vertices`].
    free_vertices: Vec<[bool; 4]>,
    part: Arc<Part>,
    /// Whether the laws make the tangent unsymmetric.
    unsymmetric: bool,
    /// The two vertices of the edge of each midpoint. Midpoints are numbered after the vertices.
    parents: Arc<Vec<[u32; 2]>>,
    /// For each vertex, the midpoints of its edges in increasing order. Midpoint 0 is the first node after the
    /// vertices.
    children: Groups,
    /// Weights 1/|A_ii| at the time when the largest eigenvalue for the smoother was estimated; zero for constrained
    /// values.
    weight: Vec<Nodal>,
    /// Work vector for A x.
    product_of_x: Vec<Nodal>,
    /// Error of the device that stored the current tangent.
    lost: Option<DeviceError>,
}

impl ElementTangent {
    /// Creates the tangent; `product` multiplies a vector by the tangent of the elements of this part of the mesh.
    pub(crate) fn new(
        product: Box<dyn Product>,
        parents: Arc<Vec<[u32; 2]>>,
        part: Arc<Part>,
    ) -> Self {
        let vertices = parents.iter().flatten().max().map_or(0, |&v| v as usize + 1);
        Self {
            children: midpoints_of_vertices(&parents, vertices),
            product,
            contact: Vec::new(),
            pairs: Vec::new(),
            free: Vec::new(),
            free_vertices: Vec::new(),
            part,
            unsymmetric: false,
            parents,
            weight: Vec::new(),
            product_of_x: Vec::new(),
            lost: None,
        }
    }

    /// Linearises the equations of the elements and returns the diagonal of the tangent. If a device fails, the
    /// processor linearises.
    pub(crate) fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<Vec<Nodal>, Inverted> {
        self.contact = increment.context.contact.to_vec();
        self.pairs = increment.context.pairs.to_vec();
        self.unsymmetric = operator.domain().rule().extra.unsymmetric;
        self.free = free.to_vec();
        self.constrain_vertices();
        loop {
            let sound = self.product.linearise(operator, increment, coupling);
            if self.part.ranks().any(sound.is_err()) {
                return Err(Inverted);
            }
            match self.product.diagonal() {
                Ok(diagonal) => return Ok(self.whole_diagonal(diagonal)),
                Err(error) => self.lose(error),
            }
        }
    }

    /// Marks the values of the vertices that are free on the level of linear elements.
    ///
    /// The matrix of the linear level contains no constraints of midpoints. A displacement is therefore constrained at
    /// both vertices of an edge if it is constrained at the midpoint of the edge. Otherwise the matrix would be
    /// singular for a body that is supported only at midpoints. In a curved mesh, the supports against rigid motions
    /// may be midpoints.
    pub(crate) fn free_vertices(&self) -> &[[bool; 4]] {
        &self.free_vertices
    }

    fn constrain_vertices(&mut self) {
        let vertices = self.free.len() - self.parents.len();
        let mut constrained = vec![[0.0; 3]; vertices];
        for (parents, free) in self.parents.iter().zip(&self.free[vertices..]) {
            for &vertex in parents {
                (0..3).for_each(|k| constrained[vertex as usize][k] += f64::from(!free[k]));
            }
        }
        if self.is_quadratic() {
            self.part.vertices.complete(&mut constrained);
        }
        self.free_vertices = self.free[..vertices].to_vec();
        for (free, constrained) in self.free_vertices.iter_mut().zip(constrained) {
            (0..3).for_each(|k| free[k] &= constrained[k] == 0.0);
        }
    }

    /// Discards the device that stored the tangent.
    fn lose(&mut self, error: DeviceError) {
        self.product.leave_device();
        self.lost = Some(error);
    }

    /// Returns the error of the device that stored the current tangent, if the device has failed, and clears the error.
    /// After a failure, products with the tangent are NaN until [`linearise`](Self::linearise) is called.
    pub(crate) fn take_lost(&mut self) -> Option<DeviceError> {
        self.lost.take()
    }

    /// Returns the product with the tangent of the elements, without contact.
    pub(crate) fn product(&mut self) -> &mut dyn Product {
        self.product.as_mut()
    }

    pub(crate) fn contact(&self) -> &[NodeBlock] {
        &self.contact
    }

    /// Whether the elements are quadratic.
    pub(crate) fn is_quadratic(&self) -> bool {
        !self.parents.is_empty()
    }

    /// Computes y = A x for all values, including constrained values.
    pub(crate) fn multiply_whole(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        if let Err(error) = self.product.apply(x, y) {
            self.lose(error);
            y.fill([f64::NAN; 4]);
        }
        self.part.halo.complete(y);
        for (node, block) in &self.contact {
            let (x, y) = (&x[*node as usize], &mut y[*node as usize]);
            for i in 0..3 {
                y[i] += (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
        add_pair_products(&self.pairs, x, y);
    }

    /// Adds the contributions of other ranks and of contact to the diagonal of this rank's elements.
    fn whole_diagonal(&self, mut diagonal: Vec<Nodal>) -> Vec<Nodal> {
        self.part.halo.complete(&mut diagonal);
        for (node, block) in &self.contact {
            (0..3).for_each(|k| diagonal[*node as usize][k] += block[k][k]);
        }
        for (row, _, block) in self.pairs.iter().filter(|(row, column, _)| row == column) {
            (0..3).for_each(|k| diagonal[*row as usize][k] += block[k][k]);
        }
        diagonal
    }

    /// Computes the tangent of the linear shape functions, or the contribution of this rank to that
    /// tangent.
    pub(crate) fn add_linear(&mut self, out: &mut Tangent) {
        out.clear();
        if let Err(error) = self.product.add_linear(out) {
            return self.lose(error);
        }
        // with linear shape functions, the values at a midpoint are the mean of the values at the two vertices of its
        // edge
        let vertices = out.pattern.graph.nodes();
        let ends = |node: u32| match (node as usize).checked_sub(vertices) {
            None => vec![(node, 1.0)],
            Some(midpoint) => self.parents[midpoint].map(|p| (p, 0.5)).to_vec(),
        };
        for (row, column, block) in &self.pairs {
            for (a, share) in ends(*row) {
                for (b, other) in ends(*column) {
                    out.add_pair(&(a, b, block.map(|row| row.map(|entry| share * other * entry))));
                }
            }
        }
        let halo = &self.part.halo;
        for (node, block) in self.contact.iter().filter(|(node, _)| halo.owns(*node)) {
            let ends = ends(*node);
            for &(a, share) in &ends {
                for &(b, other) in &ends {
                    let position = out.pattern.graph.position(a as usize, b);
                    for i in 0..3 {
                        for j in 0..3 {
                            out.blocks[position][i][j] += share * other * block[i][j];
                        }
                    }
                }
            }
        }
        out.symmetric = self.symmetric();
    }

    /// Whether the laws and the contributions of contact on this rank are symmetric.
    pub(crate) fn symmetric(&self) -> bool {
        let even = |b: &[[f64; 3]; 3]| (0..3).all(|i| (0..i).all(|j| b[i][j] == b[j][i]));
        !self.unsymmetric
            && self.pairs.is_empty()
            && self.contact.iter().all(|(_, block)| even(block))
    }

    /// Creates the multigrid level of quadratic elements for the current tangent; `None` for linear elements. `weight`
    /// contains 1/|A_ii| for the free values.
    pub(crate) fn level(&mut self, weight: &[Nodal]) -> Option<Level<NodalVectors, NodalVectors>> {
        if !self.is_quadratic() {
            return None;
        }
        self.weight = weight.to_vec();
        let (vectors, coarse) =
            (NodalVectors::new(&self.part.halo), NodalVectors::new(&self.part.vertices));
        let residual = vec![[0.0; 4]; weight.len()];
        let smoother = Smoother::measured(&vectors, self, DEGREE, &residual);
        let right = vec![[0.0; 4]; weight.len() - self.parents.len()];
        Some(Level::new(vectors, &coarse, smoother, residual, right))
    }
}

impl Matrix for ElementTangent {
    type Space = NodalVectors;

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

    fn relax(&self, coefficients: Relaxation, r: &[Nodal], step: &mut [Nodal], x: &mut [Nodal]) {
        let weight = self.weight.as_slice();
        let scale = |node: usize, r: &Nodal| std::array::from_fn(|k| weight[node][k] * r[k]);
        relax(coefficients, scale, r, step, x);
    }
}

impl Grid for ElementTangent {
    type Matrix = Self;
    type Coarse = NodalVectors;

    fn matrix(&mut self) -> &mut Self {
        self
    }

    /// Adds half of the value of each midpoint to both vertices of its edge.
    fn restrict(&mut self, residual: &[Nodal], right: &mut [Nodal]) {
        let (part, vertices) = (&self.part, right.len());
        if !part.is_whole() {
            // only the rank that owns a node adds its contribution
            let [own_vertices, own_midpoints] = part.halo.owned_ranges(residual.len());
            right.fill([0.0; 4]);
            right[own_vertices.clone()].copy_from_slice(&residual[own_vertices]);
            let first = own_midpoints.start - vertices;
            for (parents, r) in self.parents[first..].iter().zip(&residual[own_midpoints]) {
                for &p in parents {
                    (0..4).for_each(|k| right[p as usize][k] += 0.5 * r[k]);
                }
            }
            part.vertices.complete(right);
            return mask(&self.free_vertices, right);
        }
        let (free, children) = (&self.free_vertices, &self.children);
        right.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(vertex, sum)| {
            *sum = residual[vertex];
            for &midpoint in children.of(vertex) {
                let r = &residual[vertices + midpoint as usize];
                (0..4).for_each(|k| sum[k] += 0.5 * r[k]);
            }
            (0..4).for_each(|k| sum[k] = if free[vertex][k] { sum[k] } else { 0.0 });
        });
    }

    /// Adds the vertex values `x` to `z`: at each vertex its value, and at each midpoint the mean of the values of the
    /// two vertices of its edge.
    fn add_prolonged(&mut self, x: &[Nodal], z: &mut [Nodal]) {
        let add = |z: &mut Nodal, free: &[bool; 4], x: Nodal| {
            (0..4).for_each(|k| z[k] += if free[k] { x[k] } else { 0.0 });
        };
        let (on_vertices, on_midpoints) = z.split_at_mut(x.len());
        let (free_vertices, free_midpoints) = self.free.split_at(x.len());
        let vertices = on_vertices.par_iter_mut().with_min_len(CHUNK).zip(free_vertices);
        vertices.zip(x).for_each(|((z, free), x)| add(z, free, *x));
        let midpoints = on_midpoints.par_iter_mut().with_min_len(CHUNK).zip(free_midpoints);
        midpoints.zip(&*self.parents).for_each(|((z, free), parents)| {
            let [a, b] = parents.map(|p| &x[p as usize]);
            add(z, free, std::array::from_fn(|k| 0.5 * (a[k] + b[k])));
        });
    }
}

impl FreeTangent for ElementTangent {
    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.multiply_whole(x, y);
        mask(&self.free, y);
    }

    fn mask(&self, x: &mut [Nodal]) {
        mask(&self.free, x);
    }
}

/// Returns the midpoints of the edges at each vertex, in increasing order. `parents` contains the two vertices of the
/// edge of each midpoint.
pub(crate) fn midpoints_of_vertices(parents: &[[u32; 2]], vertices: usize) -> Groups {
    let pairs = (0..).zip(parents).flat_map(|(midpoint, ends)| ends.map(|end| (end, midpoint)));
    Groups::new(vertices, pairs)
}
