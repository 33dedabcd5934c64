//! Krylov iterations on a device. The processor creates the multigrid hierarchy and copies it to the device. For a
//! linear solve, the processor sends the right-hand side to the device and receives the solution.

mod kernels;
mod matrices;
mod tangent;
mod vectors;

use std::sync::Arc;

use self::matrices::{FieldSplitOnDevice, copy_of};
use self::tangent::{DeviceTangent, NodalData};
use self::vectors::{DeviceVectors, Session};
use super::in_memory::Nodal;
use super::krylov::{Ending, Preconditioned, System, solve};
use super::multigrid::{
    DEGREE, ElementTangent, FieldSplitInMemory, Level, MatrixFree, Multigrid, Smoother,
};
use crate::device::{Array, ComputeDevice, DeviceError};
use crate::operator::{AppliedOnDevice, NodeBlock};

/// Multigrid levels of a mesh on a device.
#[derive(Debug)]
pub(super) struct OnDevice {
    name: String,
    session: Arc<Session>,
    nodal: NodalData,
    /// Weights 1/|A_ii| of the residual norm; zero for constrained values.
    weight: Array<f64>,
    multigrid: Option<MultigridOnDevice>,
}

type MultigridOnDevice = Multigrid<DeviceVectors<f64>, FieldSplitOnDevice>;

impl OnDevice {
    pub(super) fn new(
        device: &ComputeDevice,
        vertices: usize,
        parents: &[[u32; 2]],
    ) -> Result<Self, DeviceError> {
        let session = Arc::new(Session::new(device.clone())?);
        let nodal = NodalData::new(&session, vertices, parents);
        let weight = session.zeros(4 * (vertices + parents.len()));
        session.check()?;
        Ok(Self { name: device.name(), session, nodal, weight, multigrid: None })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Stores the constraints, weights and contact of a new tangent. `free` marks the free values of all nodes, and the
    /// free values of the vertices on the level of linear elements.
    pub(super) fn constrain(
        &mut self,
        free: [&[[bool; 4]]; 2],
        weight: &[Nodal],
        contact: &[NodeBlock],
    ) {
        self.nodal.constrain(free, contact);
        self.session.attempt(|_| self.weight.write(0, weight.as_flattened()));
    }

    pub(super) fn has_hierarchy(&self) -> bool {
        self.multigrid.is_some()
    }

    pub(super) fn discard_hierarchy(&mut self) {
        self.multigrid = None;
    }

    /// Copies a new hierarchy to the device, and estimates the eigenvalues for the smoother of the quadratic level.
    pub(super) fn renew(
        &mut self,
        tangent: &mut ElementTangent,
        weight: &[Nodal],
        split: &FieldSplitInMemory,
    ) -> Result<(), DeviceError> {
        let below = copy_of(&self.session, split);
        let quadratic = match tangent.is_quadratic() {
            true => Some(self.quadratic_level(tangent, weight)?),
            false => None,
        };
        self.multigrid = Some(Multigrid { quadratic, below });
        self.session.check()
    }

    fn quadratic_level(
        &mut self,
        tangent: &mut ElementTangent,
        weight: &[Nodal],
    ) -> Result<Level<DeviceVectors<f64>, DeviceVectors<f64>>, DeviceError> {
        self.nodal.set_smoother_weight(weight);
        let vectors = DeviceVectors::new(&self.session);
        let residual = self.session.zeros(4 * weight.len());
        let right = self.session.zeros(4 * self.nodal.vertices);
        let mut matrix = DeviceTangent { product: product_of(tangent)?, nodal: &mut self.nodal };
        let smoother = Smoother::measured(&vectors, &mut matrix, DEGREE, &residual);
        Ok(Level::new(vectors.clone(), &vectors, smoother, residual, right))
    }

    /// Solves a linear system on the device by the Krylov method [`solve`].
    pub(super) fn krylov(
        &mut self,
        tangent: &mut ElementTangent,
        definite: &mut bool,
        right: &[Nodal],
        step: &mut [Nodal],
        (tolerance, limit): (f64, u32),
    ) -> Result<Ending, DeviceError> {
        let Self { session, nodal, weight, multigrid, .. } = self;
        let (b, mut x) = (session.array(right.as_flattened()), session.zeros(4 * right.len()));
        let mut tangent = DeviceTangent { product: product_of(tangent)?, nodal };
        let mut matrix = MatrixFree { tangent: &mut tangent, multigrid: current(multigrid)? };
        let vectors = DeviceVectors::new(session);
        let mut system = System { vectors: &vectors, matrix: &mut matrix, weight };
        let ending = solve(&mut system, definite, &b, &mut x, tolerance, limit);
        session.attempt(|_| x.read(step.as_flattened_mut()));
        session.check()?;
        Ok(ending)
    }

    /// Computes z ≈ A⁻¹ r by one multigrid cycle, where A is the tangent.
    pub(super) fn precondition(
        &mut self,
        tangent: &mut ElementTangent,
        right: &[Nodal],
        out: &mut [Nodal],
    ) -> Result<(), DeviceError> {
        let Self { session, nodal, multigrid, .. } = self;
        let (r, mut z) = (session.array(right.as_flattened()), session.zeros(4 * right.len()));
        let mut tangent = DeviceTangent { product: product_of(tangent)?, nodal };
        let mut matrix = MatrixFree { tangent: &mut tangent, multigrid: current(multigrid)? };
        matrix.precondition(&r, &mut z);
        session.attempt(|_| z.read(out.as_flattened_mut()));
        session.check()
    }
}

fn product_of(tangent: &mut ElementTangent) -> Result<&mut dyn AppliedOnDevice, DeviceError> {
    let product = tangent.product().on_device();
    product.ok_or_else(|| DeviceError("the tangent is not on a device".into()))
}

fn current(
    multigrid: &mut Option<MultigridOnDevice>,
) -> Result<&mut MultigridOnDevice, DeviceError> {
    multigrid.as_mut().ok_or_else(|| DeviceError("the hierarchy is not on the device".into()))
}
