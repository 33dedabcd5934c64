//! Interface between solvers and the implementations of the equations.

use std::sync::Arc;

use super::cell_stress::CellStress;
use super::increment::{Increment, Residual};
use super::layout::LANES;
use super::pattern::Tangent;
use crate::device::{Argument, Array, DeviceError};
use crate::element::Domain;
use crate::material::Inverted;
use crate::parallel::Part;

/// Whether the tangent includes the coupling terms between displacement and damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// Consistent tangent with coupling terms.
    Full,
    /// Block diagonal tangent without coupling terms, for alternate minimisation.
    Separate,
}

/// Discrete equations on a mesh, for any element type.
///
/// A residual contains the contributions of the whole body: at a node that several ranks share, it is the same on
/// all these ranks. Tangents and products contain only the elements of this rank. If one rank fails, all ranks fail.
pub trait Operator: std::fmt::Debug + Send + Sync {
    /// Computes residual and energies. Fails if an element is inverted.
    fn residual(&self, increment: &Increment, out: &mut Residual) -> Result<(), Inverted>;

    /// Assembles the consistent tangent.
    fn tangent(
        &self,
        increment: &Increment,
        coupling: Coupling,
        out: &mut Tangent,
    ) -> Result<(), Inverted>;

    /// Computes the state of the laws at the end of the increment: [`state_len`](super::state_len) values per elastic
    /// point, in the order of the elements and of their elastic points.
    fn state(&self, increment: &Increment, out: &mut [f64]) -> Result<(), Inverted>;

    /// Computes mean stress and elastic energy density of each element.
    fn stresses(&self, increment: &Increment) -> Result<Vec<CellStress>, Inverted>;

    /// Computes the configurational forces ∫ (ψ I − Hᵀ P) ∇N_a dV of all nodes, N: ψ is the elastic energy density, H
    /// the displacement gradient, P the nominal stress.
    fn configurational(&self, increment: &Increment) -> Result<Vec<[f64; 3]>, Inverted>;

    /// Computes the stored data of the tangents of the elements `tets`, in the order of
    /// [`DataLayout`](super::DataLayout). Calls `write` for each batch of [`LANES`] elements with the index of the
    /// batch and its data.
    fn point_data(
        &self,
        increment: &Increment,
        coupling: Coupling,
        tets: &[u32],
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted>;

    /// Returns the mesh and its geometry.
    fn domain(&self) -> &dyn Domain;

    /// Returns the elements and nodes of this rank.
    fn part(&self) -> &Arc<Part>;

    /// Returns the implementation of the equations on a device, if a device evaluates them.
    fn on_device(&self) -> Option<&dyn EquationsOnDevice> {
        None
    }
}

/// Equations that are evaluated on the same device as the product with their tangent.
pub trait EquationsOnDevice {
    /// Writes the stored data of the fully coupled tangent into the arrays of the product, one array for plain
    /// elements (straight, no mixture) and one for all others. `None` if the device cannot linearise; the processor
    /// must then linearise.
    fn linearise(&self, increment: &Increment, data: &[Argument]) -> Option<Result<(), Inverted>>;

    /// Returns the error of the device, if the device has failed and is no longer used.
    fn lost(&self) -> Option<DeviceError>;
}

/// Product of the tangent with vectors in the memory of a device.
pub trait AppliedOnDevice {
    /// Computes y = A x, with four values per node.
    fn apply(&mut self, x: &Array<f64>, y: &mut Array<f64>) -> Result<(), DeviceError>;
}

/// Tangent that is applied without being assembled (matrix-free).
pub trait Product: std::fmt::Debug + Send {
    /// Linearises the equations at an increment and stores the tangent.
    fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted>;

    /// Computes y = A x for nodal values u_x, u_y, u_z, φ. Fails if the tangent is stored on a device that has
    /// failed.
    fn apply(&mut self, x: &[[f64; 4]], y: &mut [[f64; 4]]) -> Result<(), DeviceError>;

    /// Returns the diagonal, four values per node. Fails if the tangent is stored on a device that has failed.
    fn diagonal(&mut self) -> Result<Vec<[f64; 4]>, DeviceError>;

    /// Adds the tangent of linear shape functions on the same elements to `out`. For quadratic elements, this tangent
    /// is the next coarser level of the multigrid method; its nodes are the first four nodes of each element. Fails
    /// if the tangent is stored on a device that has failed.
    fn add_linear(&mut self, out: &mut Tangent) -> Result<(), DeviceError>;

    /// Computes all later tangents on the processor, because the device has failed.
    fn leave_device(&mut self) {}

    /// Returns the implementation of the product on a device, if the product uses a device.
    fn on_device(&mut self) -> Option<&mut dyn AppliedOnDevice> {
        None
    }

    /// Returns the memory of the tangent in bytes.
    #[cfg(feature = "bench-internals")]
    fn bytes(&self) -> usize;
}
