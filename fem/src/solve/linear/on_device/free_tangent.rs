//! Tangent on the values that are not constrained, on a device.

use std::cell::RefCell;
use std::collections::BTreeMap;

use super::vectors::DeviceVectors;
use crate::device::{Argument, Array};
use crate::operator::{AppliedOnDevice, NodeBlock};
use crate::solve::linear::vector::Nodal;

/// Constraints, weights and contact of the current tangent.
#[derive(Debug)]
pub(super) struct Constraints {
    free: Array<u8>,
    /// 1/|A_ii|, zero in constrained values.
    weight: Array<f64>,
    /// Contributions of contact: each node once, and its block.
    node: Array<u32>,
    block: Array<f64>,
}

impl Constraints {
    pub(super) fn new(vectors: &DeviceVectors, values: usize) -> Self {
        Self {
            free: vectors.zeros(values),
            weight: vectors.zeros(values),
            node: vectors.zeros(0),
            block: vectors.zeros(0),
        }
    }

    /// Stores the constraints, weights and contact of a new tangent.
    pub(super) fn take(
        &mut self,
        vectors: &DeviceVectors,
        free: &[[bool; 4]],
        weight: &[Nodal],
        contact: &[NodeBlock],
    ) {
        let mut blocks = BTreeMap::<u32, [[f64; 3]; 3]>::new();
        for (node, block) in contact {
            let sum = blocks.entry(*node).or_default();
            (0..9).for_each(|k| sum[k / 3][k % 3] += block[k / 3][k % 3]);
        }
        let nodes: Vec<u32> = blocks.keys().copied().collect();
        let values: Vec<f64> = blocks.into_values().flatten().flatten().collect();
        let free: Vec<u8> = free.as_flattened().iter().map(|&free| u8::from(free)).collect();
        vectors.attempt(|_| self.free.write(0, &free));
        vectors.attempt(|_| self.weight.write(0, weight.as_flattened()));
        self.node = vectors.array(&nodes);
        self.block = vectors.array(&values);
    }

    pub(super) fn weight(&self) -> &Array<f64> {
        &self.weight
    }

    pub(super) fn free(&self) -> Argument<'_> {
        self.free.argument()
    }
}

/// Matrix on the values that are not constrained, on a device.
pub(super) struct FreeTangent<'a> {
    pub(super) vectors: &'a DeviceVectors,
    pub(super) constraints: &'a Constraints,
    pub(super) product: RefCell<&'a mut dyn AppliedOnDevice>,
}

impl FreeTangent<'_> {
    pub(super) fn multiply(&self, x: &Array<f64>, y: &mut Array<f64>) {
        let Self { vectors, constraints, product } = self;
        vectors.attempt(|_| product.borrow_mut().apply(x, y));
        let [node, block] = [constraints.node.argument(), constraints.block.argument()];
        vectors.launch(
            "contact",
            constraints.node.len(),
            &[node, block, x.argument(), y.argument()],
        );
        self.mask(y);
    }

    /// Sets the constrained values to zero.
    pub(super) fn mask(&self, x: &mut Array<f64>) {
        let free = self.constraints.free.argument();
        self.vectors.launch("mask", x.len(), &[free, x.argument()]);
    }
}
