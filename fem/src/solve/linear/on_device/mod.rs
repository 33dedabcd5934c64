//! Iterations on a device: the processor linearises and makes the hierarchy, a solution sends one right-hand
//! side and gets one step.

mod hierarchy;
mod kernels;
mod levels;
mod vectors;

use std::cell::RefCell;
use std::collections::BTreeMap;

use self::levels::Levels;
use self::vectors::DeviceVectors;
use super::field_split::FieldSplit;
use super::krylov::{Ending, System, solve};
use super::quadratic::QuadraticLevel;
use super::vector::Nodal;
use crate::device::{Array, ComputeDevice, DeviceError};
use crate::operator::{AppliedOnDevice, NodeBlock};

/// The levels of a mesh on a device.
#[derive(Debug)]
pub(super) struct OnDevice {
    name: String,
    vectors: DeviceVectors,
    constraints: Constraints,
    levels: Levels,
}

/// What changes from tangent to tangent.
#[derive(Debug)]
struct Constraints {
    free: Array<u8>,
    /// 1/|A_ii|, zero in constrained values.
    weight: Array<f64>,
    /// What contact adds: nodes, each once, and their blocks.
    node: Array<u32>,
    block: Array<f64>,
}

/// A matrix on the values that are not constrained, and where it is.
struct FreeTangent<'a> {
    vectors: &'a DeviceVectors,
    constraints: &'a Constraints,
    product: RefCell<&'a mut dyn AppliedOnDevice>,
}

impl FreeTangent<'_> {
    fn multiply(&self, x: &Array<f64>, y: &mut Array<f64>) {
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
    fn mask(&self, x: &mut Array<f64>) {
        let free = self.constraints.free.argument();
        self.vectors.launch("mask", x.len(), &[free, x.argument()]);
    }
}

impl OnDevice {
    pub(super) fn new(
        device: &ComputeDevice,
        vertices: usize,
        parents: &[[u32; 2]],
    ) -> Result<Self, DeviceError> {
        let vectors = DeviceVectors::new(device.clone())?;
        let values = 4 * (vertices + parents.len());
        let constraints = Constraints {
            free: vectors.zeros(values),
            weight: vectors.zeros(values),
            node: vectors.zeros(0),
            block: vectors.zeros(0),
        };
        let levels = Levels::new(&vectors, vertices, parents);
        match vectors.take_failure() {
            None => Ok(Self { name: device.name(), vectors, constraints, levels }),
            Some(error) => Err(error),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Takes over what a new tangent constrains.
    pub(super) fn constrain(
        &mut self,
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
        let Self { vectors, constraints, .. } = self;
        vectors.attempt(|_| constraints.free.write(0, &free));
        vectors.attempt(|_| constraints.weight.write(0, weight.as_flattened()));
        constraints.node = vectors.array(&nodes);
        constraints.block = vectors.array(&values);
    }

    /// Takes over a hierarchy, and measures the largest eigenvalue above it.
    pub(super) fn renew(
        &mut self,
        level: &mut QuadraticLevel,
        weight: &[Nodal],
        split: &FieldSplit,
    ) -> Result<(), DeviceError> {
        let Self { vectors, constraints, levels, .. } = self;
        let product = RefCell::new(product_of(level)?);
        let matrix = FreeTangent { vectors, constraints, product };
        levels.renew(&matrix, weight, split);
        vectors.take_failure().map_or(Ok(()), Err)
    }

    /// Solves as [`solve`] does.
    pub(super) fn krylov(
        &mut self,
        level: &mut QuadraticLevel,
        definite: &mut bool,
        right: &[Nodal],
        step: &mut [Nodal],
        (tolerance, limit): (f64, u32),
    ) -> Result<Ending, DeviceError> {
        let Self { vectors, constraints, levels, .. } = self;
        let vectors = &*vectors;
        let (b, mut x) = (vectors.array(right.as_flattened()), vectors.zeros(4 * right.len()));
        let product = RefCell::new(product_of(level)?);
        let matrix = FreeTangent { vectors, constraints, product };
        let mut apply = |x: &Array<f64>, y: &mut Array<f64>| matrix.multiply(x, y);
        let mut precondition =
            |r: &Array<f64>, z: &mut Array<f64>| levels.precondition(&matrix, r, z);
        let weight = &constraints.weight;
        let mut system =
            System { vectors, apply: &mut apply, precondition: &mut precondition, weight };
        let ending = solve(&mut system, definite, &b, &mut x, tolerance, limit);
        vectors.attempt(|_| x.read(step.as_flattened_mut()));
        vectors.take_failure().map_or(Ok(ending), Err)
    }

    /// z ≈ A⁻¹ r by one cycle through the levels.
    pub(super) fn precondition(
        &mut self,
        level: &mut QuadraticLevel,
        right: &[Nodal],
        out: &mut [Nodal],
    ) -> Result<(), DeviceError> {
        let Self { vectors, constraints, levels, .. } = self;
        let vectors = &*vectors;
        let (r, mut z) = (vectors.array(right.as_flattened()), vectors.zeros(4 * right.len()));
        let product = RefCell::new(product_of(level)?);
        let matrix = FreeTangent { vectors, constraints, product };
        levels.precondition(&matrix, &r, &mut z);
        vectors.attempt(|_| z.read(out.as_flattened_mut()));
        vectors.take_failure().map_or(Ok(()), Err)
    }
}

fn product_of(level: &mut QuadraticLevel) -> Result<&mut dyn AppliedOnDevice, DeviceError> {
    level.product().on_device().ok_or_else(|| DeviceError("the tangent is not on a device".into()))
}
