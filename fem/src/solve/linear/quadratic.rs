//! The level of quadratic elements above the linear ones: matrix-free, smoothed by Chebyshev
//! polynomials of the tangent with its diagonal.

use std::sync::Arc;

use super::chebyshev::coefficients;
use super::vector::{Nodal, add_scaled, dot, mask, scale_and_add};
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, NodeBlock, Operator, Product, Tangent};

const DEGREE: usize = 3;
const POWER_STEPS: usize = 10;
const MARGIN: f64 = 1.1;

#[derive(Debug)]
pub(super) struct Quadratic {
    product: Box<dyn Product>,
    /// What contact adds at nodes.
    contact: Vec<NodeBlock>,
    /// The vertices that each midpoint stands between; midpoints follow the vertices.
    parents: Arc<Vec<[u32; 2]>>,
    /// 1/|A_ii|, zero in constrained values.
    weight: Vec<Nodal>,
    largest: f64,
}

impl Quadratic {
    pub(super) fn new(product: Box<dyn Product>, parents: Arc<Vec<[u32; 2]>>) -> Self {
        Self { product, contact: Vec::new(), parents, weight: Vec::new(), largest: 1.0 }
    }

    pub(super) fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted> {
        self.contact = increment.context.contact.to_vec();
        self.product.linearise(operator, increment, coupling)
    }

    pub(super) fn multiply(&mut self, free: &[[bool; 4]], x: &[Nodal], y: &mut [Nodal]) {
        self.product.apply(x, y);
        for (node, block) in &self.contact {
            let (x, y) = (&x[*node as usize], &mut y[*node as usize]);
            for i in 0..3 {
                y[i] += (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
        mask(free, y);
    }

    pub(super) fn diagonal(&mut self) -> Vec<Nodal> {
        let mut diagonal = self.product.diagonal();
        for (node, block) in &self.contact {
            (0..3).for_each(|k| diagonal[*node as usize][k] += block[k][k]);
        }
        diagonal
    }

    /// The tangent of the level below.
    pub(super) fn add_linear(&self, out: &mut Tangent) {
        out.clear();
        self.product.add_linear(out);
        // a midpoint's values are the mean of its vertices'
        let vertices = out.pattern.graph.nodes();
        for (node, block) in &self.contact {
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

    /// Whether contact leaves the tangent symmetric.
    pub(super) fn symmetric(&self) -> bool {
        let even = |b: &[[f64; 3]; 3]| (0..3).all(|i| (0..i).all(|j| b[i][j] == b[j][i]));
        self.contact.iter().all(|(_, block)| even(block))
    }

    /// Takes over the weights of the current diagonal and measures the largest eigenvalue.
    pub(super) fn renew(&mut self, weight: &[Nodal], free: &[[bool; 4]]) {
        self.weight = weight.to_vec();
        let n = weight.len();
        let mut x: Vec<Nodal> = (0..n)
            .map(|i| std::array::from_fn(|k| ((4 * i + k) as f64 * 1.7 + 0.3).sin()))
            .collect();
        mask(free, &mut x);
        let mut y = vec![[0.0; 4]; n];
        for _ in 0..POWER_STEPS {
            self.multiply(free, &x, &mut y);
            for (y, w) in y.iter_mut().zip(&self.weight) {
                (0..4).for_each(|k| y[k] *= w[k]);
            }
            let (before, after) = (dot(&x, &x).sqrt(), dot(&y, &y).sqrt());
            if before == 0.0 || after == 0.0 {
                break;
            }
            self.largest = MARGIN * after / before;
            for (x, y) in x.iter_mut().zip(&y) {
                *x = y.map(|v| v / after);
            }
        }
    }

    /// z ≈ A⁻¹ r: smoothing, the level below, smoothing.
    pub(super) fn precondition(
        &mut self,
        free: &[[bool; 4]],
        r: &[Nodal],
        z: &mut [Nodal],
        below: impl FnOnce(&[Nodal], &mut [Nodal]),
    ) {
        let n = r.len();
        let vertices = n - self.parents.len();
        let (mut residual, mut step) = (r.to_vec(), vec![[0.0; 4]; n]);
        let mut work = vec![[0.0; 4]; n];
        z.fill([0.0; 4]);
        self.smooth(free, &mut residual, z, &mut step, &mut work);
        self.multiply(free, z, &mut residual);
        scale_and_add(&mut residual, -1.0, r);
        let mut right = residual[..vertices].to_vec();
        for (parents, r) in self.parents.iter().zip(&residual[vertices..]) {
            for &p in parents {
                (0..4).for_each(|k| right[p as usize][k] += 0.5 * r[k]);
            }
        }
        mask(&free[..vertices], &mut right);
        let mut correction = vec![[0.0; 4]; vertices];
        below(&right, &mut correction);
        for (z, c) in z.iter_mut().zip(&correction) {
            (0..4).for_each(|k| z[k] += c[k]);
        }
        for ((z, parents), free) in
            z[vertices..].iter_mut().zip(self.parents.iter()).zip(&free[vertices..])
        {
            let [a, b] = parents.map(|p| &correction[p as usize]);
            for k in 0..4 {
                z[k] += if free[k] { 0.5 * (a[k] + b[k]) } else { 0.0 };
            }
        }
        self.multiply(free, z, &mut residual);
        scale_and_add(&mut residual, -1.0, r);
        self.smooth(free, &mut residual, z, &mut step, &mut work);
    }

    fn smooth(
        &mut self,
        free: &[[bool; 4]],
        residual: &mut [Nodal],
        z: &mut [Nodal],
        step: &mut [Nodal],
        work: &mut [Nodal],
    ) {
        let steps = coefficients(self.largest, DEGREE);
        for (i, &(momentum, weight)) in steps.iter().enumerate() {
            let (momentum, weight) = (f64::from(momentum), f64::from(weight));
            for ((step, r), w) in step.iter_mut().zip(residual.iter()).zip(&self.weight) {
                for k in 0..4 {
                    let kept = if i == 0 { 0.0 } else { momentum * step[k] };
                    step[k] = kept + weight * w[k] * r[k];
                }
            }
            add_scaled(z, 1.0, step);
            if i + 1 < steps.len() {
                self.multiply(free, step, work);
                add_scaled(residual, -1.0, work);
            }
        }
    }
}
