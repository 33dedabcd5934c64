//! One multigrid cycle on a device, with the same operations as [`QuadraticLevel`](super::QuadraticLevel) and the
//! levels below it on the processor.

use super::free_tangent::FreeTangent;
use super::hierarchy::DeviceSplit;
use super::vectors::DeviceVectors;
use crate::device::{Argument, Array};
use crate::solve::linear::chebyshev::{Lanczos, coefficients};
use crate::solve::linear::field_split::FieldSplit;
use crate::solve::linear::quadratic::DEGREE;
use crate::solve::linear::vector::{Nodal, Vectors};

/// Quadratic level (if the elements are quadratic), and all coarser levels.
#[derive(Debug)]
pub(super) struct Levels {
    vertices: usize,
    /// `parents`: vertices at the ends of the edge of each midpoint. `start` and `midpoint`: midpoints of each vertex
    /// as offsets and node numbers.
    parents: Array<u32>,
    start: Array<u32>,
    midpoint: Array<u32>,
    smoother: Smoother,
    residual: Array<f64>,
    /// Right-hand side and solution of the linear level.
    right: Array<f64>,
    correction: Array<f64>,
    below: Option<DeviceSplit>,
}

/// The smoother of quadratic elements.
#[derive(Debug)]
struct Smoother {
    weight: Array<f64>,
    largest: f64,
    step: Array<f64>,
    product: Array<f64>,
}

impl Smoother {
    /// step ← momentum step + share D⁻¹ r, x ← x + step.
    fn step(
        &self,
        vectors: &DeviceVectors,
        [momentum, share]: [f64; 2],
        r: &Array<f64>,
        x: &mut Array<f64>,
    ) {
        let numbers = [momentum, share].map(Argument::Real);
        let [w, r, step] = [&self.weight, r, &self.step].map(Array::argument);
        let arguments = [numbers[0], numbers[1], w, r, step, x.argument()];
        vectors.launch("smooth", x.len(), &arguments);
    }

    fn smooth(&mut self, matrix: &FreeTangent, residual: &mut Array<f64>, x: &mut Array<f64>) {
        for (k, (momentum, share)) in coefficients(self.largest, DEGREE).enumerate() {
            if k > 0 {
                matrix.multiply(&self.step, &mut self.product);
                matrix.vectors.add_scaled(residual, -1.0, &self.product);
            }
            self.step(matrix.vectors, [momentum, share], residual, x);
        }
    }

    /// Computes the bound of the eigenvalues of D⁻¹ A by Lanczos' iteration, as on the processor.
    fn measure(&mut self, matrix: &FreeTangent) {
        let vectors = matrix.vectors;
        // the start vector must not be orthogonal to the rough eigenvectors
        let start: Vec<f64> = (0..self.step.len()).map(|i| (i as f64 * 1.7 + 0.3).sin()).collect();
        let mut d = vectors.array(&start);
        let [mut before, mut v] = [(); 2].map(|()| vectors.zero(&d));
        let mut lanczos = Lanczos::default();
        loop {
            vectors.clear(&mut v);
            self.step(vectors, [0.0, 1.0], &d, &mut v);
            let size = vectors.dot(&d, &v).sqrt();
            if lanczos.is_done(size) {
                break;
            }
            [d, v] = [d, v].map(|x| vectors.scaled(&x, 1.0 / size));
            matrix.multiply(&v, &mut self.product);
            let product = vectors.dot(&self.product, &v);
            let of_before = lanczos.push(size, product);
            vectors.scale_and_add(&mut before, -of_before, &self.product);
            vectors.add_scaled(&mut before, -product, &d);
            std::mem::swap(&mut before, &mut d);
        }
        self.largest = lanczos.bound();
    }
}

impl Levels {
    pub(super) fn new(vectors: &DeviceVectors, vertices: usize, parents: &[[u32; 2]]) -> Self {
        let mut of_vertex = vec![Vec::new(); vertices];
        for (midpoint, ends) in (vertices as u32..).zip(parents) {
            ends.iter().for_each(|&vertex| of_vertex[vertex as usize].push(midpoint));
        }
        let ends = of_vertex.iter().scan(0, |end, midpoints| {
            *end += midpoints.len() as u32;
            Some(*end)
        });
        let start: Vec<u32> = std::iter::once(0).chain(ends).collect();
        // linear elements have no level above the vertices
        let (above, below) = match parents.len() {
            0 => (0, 0),
            midpoints => (4 * (vertices + midpoints), 4 * vertices),
        };
        Self {
            vertices,
            parents: vectors.array(parents.as_flattened()),
            start: vectors.array(&start),
            midpoint: vectors.array(&of_vertex.concat()),
            smoother: Smoother {
                weight: vectors.zeros(above),
                largest: 1.0,
                step: vectors.zeros(above),
                product: vectors.zeros(above),
            },
            residual: vectors.zeros(above),
            right: vectors.zeros(below),
            correction: vectors.zeros(below),
            below: None,
        }
    }

    pub(super) fn renew(&mut self, matrix: &FreeTangent, weight: &[Nodal], split: &FieldSplit) {
        // free the old hierarchy before the new one is allocated
        self.below = None;
        self.below = Some(DeviceSplit::new(matrix.vectors, split));
        if self.residual.len() > 0 {
            matrix.vectors.attempt(|_| self.smoother.weight.write(0, weight.as_flattened()));
            self.smoother.measure(matrix);
        }
    }

    /// z ≈ A⁻¹ r.
    pub(super) fn precondition(
        &mut self,
        matrix: &FreeTangent,
        r: &Array<f64>,
        z: &mut Array<f64>,
    ) {
        let vectors = matrix.vectors;
        let Self { smoother, residual, right, correction, below, .. } = self;
        let below = below.as_mut().expect("the hierarchy is made before it is used");
        if residual.len() == 0 {
            below.apply(vectors, r, z);
            return matrix.mask(z);
        }
        let copy = |to: &mut Array<f64>| {
            let arguments = [Argument::Real(1.0), r.argument(), to.argument()];
            vectors.launch("scaled", r.len(), &arguments);
        };
        vectors.clear(z);
        copy(residual);
        smoother.smooth(matrix, residual, z);
        copy(residual);
        matrix.multiply(z, &mut smoother.product);
        vectors.add_scaled(residual, -1.0, &smoother.product);
        let free = matrix.constraints.free();
        let lists = [&self.start, &self.midpoint, &self.parents].map(Array::argument);
        let arguments = [lists[0], lists[1], free, residual.argument(), right.argument()];
        vectors.launch("restrict_to_vertices", right.len(), &arguments);
        below.apply(vectors, right, correction);
        let vertices = Argument::Index(self.vertices as u64);
        let arguments = [vertices, lists[2], free, correction.argument(), z.argument()];
        vectors.launch("add_from_vertices", z.len(), &arguments);
        copy(residual);
        matrix.multiply(z, &mut smoother.product);
        vectors.add_scaled(residual, -1.0, &smoother.product);
        smoother.smooth(matrix, residual, z);
        matrix.mask(z);
    }
}
