//! Iterations on a device: the processor creates the hierarchy; a solution sends one right-hand side to the device
//! and receives one step.

mod free_tangent;
mod hierarchy;
mod kernels;
mod levels;
mod vectors;

use std::cell::RefCell;

use self::free_tangent::{Constraints, FreeTangent};
use self::levels::Levels;
use self::vectors::DeviceVectors;
use super::field_split::FieldSplit;
use super::krylov::{Ending, System, solve};
use super::quadratic::QuadraticLevel;
use super::vector::Nodal;
use crate::device::{Array, ComputeDevice, DeviceError};
use crate::operator::{AppliedOnDevice, NodeBlock};

/// Multigrid levels of a mesh on a device.
#[derive(Debug)]
pub(super) struct OnDevice {
    name: String,
    vectors: DeviceVectors,
    constraints: Constraints,
    levels: Levels,
}

impl OnDevice {
    pub(super) fn new(
        device: &ComputeDevice,
        vertices: usize,
        parents: &[[u32; 2]],
    ) -> Result<Self, DeviceError> {
        let vectors = DeviceVectors::new(device.clone())?;
        let values = 4 * (vertices + parents.len());
        let constraints = Constraints::new(&vectors, values);
        let levels = Levels::new(&vectors, vertices, parents);
        match vectors.take_failure() {
            None => Ok(Self { name: device.name(), vectors, constraints, levels }),
            Some(error) => Err(error),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Stores the constraints, weights and contact of a new tangent.
    pub(super) fn constrain(
        &mut self,
        free: &[[bool; 4]],
        weight: &[Nodal],
        contact: &[NodeBlock],
    ) {
        self.constraints.take(&self.vectors, free, weight, contact);
    }

    /// Copies a new hierarchy to the device, and computes the largest eigenvalue of the quadratic level.
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
        let weight = constraints.weight();
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
