//! Tangent on the free values, on a device.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::vectors::{DeviceVectors, Session};
use crate::device::{Argument, Array};
use crate::operator::{AppliedOnDevice, NodeBlock};
use crate::solve::linear::in_memory::Nodal;
use crate::solve::linear::multigrid::{
    FreeTangent, Grid, Matrix, Relaxation, midpoints_of_vertices,
};

/// Data at the nodes for the products with the current tangent and for its multigrid levels.
#[derive(Debug)]
pub(super) struct NodalData {
    session: Arc<Session>,
    pub(super) vertices: usize,
    /// The two vertices of the edge of each midpoint.
    parents: Array<u32>,
    /// Offsets of the vertices in `midpoint`; length: `vertices` + 1.
    start: Array<u32>,
    /// Midpoints of the edges at each vertex; midpoint 0 is the first node after the vertices.
    midpoint: Array<u32>,
    /// 1 for a free value, 0 for a constrained value.
    free: Array<u8>,
    /// 1 for a value of a vertex that is free on the level of linear elements, 0 for a constrained value.
    free_vertices: Array<u8>,
    /// Inverse diagonal entries 1/|A_ii| of the tangent at the time when the smoother was created.
    smoother_weight: Array<f64>,
    /// Nodes in contact, each node once.
    contact_node: Array<u32>,
    /// Contribution of contact to the tangent at each node of `contact_node`: a 3 × 3 block, N/mm.
    contact_block: Array<f64>,
    /// Work vector for A x.
    product_of_x: Array<f64>,
}

impl NodalData {
    pub(super) fn new(session: &Arc<Session>, vertices: usize, parents: &[[u32; 2]]) -> Self {
        let midpoints = midpoints_of_vertices(parents, vertices);
        let values = 4 * (vertices + parents.len());
        // for linear elements, this level does not exist and needs no smoother
        let smoothed = if parents.is_empty() { 0 } else { values };
        Self {
            vertices,
            parents: session.array(parents.as_flattened()),
            start: session.array(&midpoints.start),
            midpoint: session.array(&midpoints.members),
            free: session.zeros(values),
            free_vertices: session.zeros(4 * vertices),
            smoother_weight: session.zeros(smoothed),
            contact_node: session.zeros(0),
            contact_block: session.zeros(0),
            product_of_x: session.zeros(smoothed),
            session: Arc::clone(session),
        }
    }

    /// Stores the constraints and contact of a new tangent. `free` marks the free values of all nodes, and the free
    /// values of the vertices on the level of linear elements.
    pub(super) fn constrain(&mut self, free: [&[[bool; 4]]; 2], contact: &[NodeBlock]) {
        let mut blocks = BTreeMap::<u32, [[f64; 3]; 3]>::new();
        for (node, block) in contact {
            let sum = blocks.entry(*node).or_default();
            (0..9).for_each(|k| sum[k / 3][k % 3] += block[k / 3][k % 3]);
        }
        let nodes: Vec<u32> = blocks.keys().copied().collect();
        let values: Vec<f64> = blocks.into_values().flatten().flatten().collect();
        let [free, free_vertices] = free.map(|free| -> Vec<u8> {
            free.as_flattened().iter().map(|&free| u8::from(free)).collect()
        });
        self.session.attempt(|_| self.free.write(0, &free));
        self.session.attempt(|_| self.free_vertices.write(0, &free_vertices));
        self.contact_node = self.session.array(&nodes);
        self.contact_block = self.session.array(&values);
    }

    /// Stores the weights of the smoother.
    pub(super) fn set_smoother_weight(&mut self, weight: &[Nodal]) {
        self.session.attempt(|_| self.smoother_weight.write(0, weight.as_flattened()));
    }
}

/// Tangent on the free values: the tangent of the elements and the nodal data.
pub(super) struct DeviceTangent<'a> {
    pub(super) product: &'a mut dyn AppliedOnDevice,
    pub(super) nodal: &'a mut NodalData,
}

impl DeviceTangent<'_> {
    fn launch(&self, name: &str, items: usize, arguments: &[Argument]) {
        self.nodal.session.launch(name, items, arguments);
    }
}

impl Matrix for DeviceTangent<'_> {
    type Space = DeviceVectors<f64>;

    fn subtract(&mut self, x: &Array<f64>, y: &mut Array<f64>) {
        let mut product = std::mem::replace(&mut self.nodal.product_of_x, Array::lost(0));
        self.multiply(x, &mut product);
        let arguments = [Argument::Real(-1.0), product.argument(), y.argument()];
        self.launch("add_scaled", y.len(), &arguments);
        self.nodal.product_of_x = product;
    }

    fn relax(
        &self,
        Relaxation { momentum, weight }: Relaxation,
        r: &Array<f64>,
        step: &mut Array<f64>,
        x: &mut Array<f64>,
    ) {
        let [momentum, weight] = [momentum, weight].map(Argument::Real);
        let [diagonal, r, step] = [&self.nodal.smoother_weight, r, step].map(Array::argument);
        self.launch("smooth", x.len(), &[momentum, weight, diagonal, r, step, x.argument()]);
    }
}

impl Grid for DeviceTangent<'_> {
    type Matrix = Self;
    type Coarse = DeviceVectors<f64>;

    fn matrix(&mut self) -> &mut Self {
        self
    }

    fn restrict(&mut self, r: &Array<f64>, b: &mut Array<f64>) {
        let NodalData { vertices, start, midpoint, free_vertices: free, .. } = &*self.nodal;
        let vertices = Argument::Index(*vertices as u64);
        let [start, midpoint] = [start, midpoint].map(Array::argument);
        let arguments = [vertices, start, midpoint, free.argument(), r.argument(), b.argument()];
        self.launch("restrict_to_vertices", b.len(), &arguments);
    }

    fn add_prolonged(&mut self, c: &Array<f64>, x: &mut Array<f64>) {
        let NodalData { vertices, parents, free, .. } = &*self.nodal;
        let (vertices, parents) = (Argument::Index(*vertices as u64), parents.argument());
        let arguments = [vertices, parents, free.argument(), c.argument(), x.argument()];
        self.launch("add_from_vertices", x.len(), &arguments);
    }
}

impl FreeTangent for DeviceTangent<'_> {
    fn multiply(&mut self, x: &Array<f64>, y: &mut Array<f64>) {
        self.nodal.session.attempt(|_| self.product.apply(x, y));
        let NodalData { contact_node: node, contact_block: block, .. } = &*self.nodal;
        let arguments = [node.argument(), block.argument(), x.argument(), y.argument()];
        self.launch("contact", node.len(), &arguments);
        self.mask(y);
    }

    fn mask(&self, x: &mut Array<f64>) {
        self.launch("mask", x.len(), &[self.nodal.free.argument(), x.argument()]);
    }
}
