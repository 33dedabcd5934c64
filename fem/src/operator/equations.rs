//! What solvers ask of the equations: the seam between methods and machines.

use std::sync::Arc;

use super::cell_stress::CellStress;
use super::layout::LANES;
use super::pattern::Tangent;
use super::residual::{Increment, Residual, Shift};
use crate::device::{Argument, Array, DeviceError};
use crate::element::Domain;
use crate::material::Inverted;
use crate::parallel::Part;

/// Whether the tangent keeps the terms between displacement and damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// The consistent tangent.
    Full,
    /// Block diagonal: each field with the other held, for alternate minimisation.
    Separate,
}

/// The equations on a space, whatever the element.
///
/// Residuals are those of the whole body, the same on all ranks that have a node; tangents and products are
/// what the elements of this rank give. All ranks fail where one does.
pub trait Operator: std::fmt::Debug + Send + Sync {
    /// Residual and energies; fails where an element is turned inside out.
    fn residual(&self, increment: &Increment, out: &mut Residual) -> Result<(), Inverted>;

    /// The consistent tangent.
    fn tangent(
        &self,
        increment: &Increment,
        coupling: Coupling,
        out: &mut Tangent,
    ) -> Result<(), Inverted>;

    /// ψ⁺ at each elastic point, element after element, or the largest value so far.
    fn driving_energies(&self, increment: &Increment, out: &mut [f64]) -> Result<(), Inverted>;

    /// Stress and elastic energy of each element.
    fn stresses(&self, increment: &Increment) -> Result<Vec<CellStress>, Inverted>;

    /// The numbers of the tangents of elements, as [`PointData`](super::point_data::PointData) orders them:
    /// `write` gets the number of a batch of [`LANES`] elements and its numbers.
    fn point_data(
        &self,
        increment: &Increment,
        coupling: Coupling,
        tets: &[u32],
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted>;

    /// How the residual at fixed fields changes with parameters: ∂R/∂θ + ∂R/∂φ_n ∂φ_n/∂θ of every
    /// node, prescribed values included, a vector for each shift. Not for damage with a history.
    fn rates(
        &self,
        increment: &Increment,
        shifts: &[Shift],
        out: &mut [Vec<[f64; 4]>],
    ) -> Result<(), Inverted>;

    /// The geometry.
    fn domain(&self) -> &dyn Domain;

    /// What this rank has of the mesh.
    fn part(&self) -> &Arc<Part>;

    /// The same equations on a device, if they are on one.
    fn on_device(&self) -> Option<&dyn EquationsOnDevice> {
        None
    }
}

/// Equations on the device that has the product with their tangent.
pub trait EquationsOnDevice {
    /// Writes the numbers of the tangent with both fields coupled into the product's, kind by kind of its
    /// elements. `None`: not there, and the processor has to.
    fn linearise(&self, increment: &Increment, data: &[Argument]) -> Option<Result<(), Inverted>>;

    /// Why the device is no longer used, if it has failed.
    fn lost(&self) -> Option<DeviceError>;
}

/// A product with vectors that are on a device.
pub trait AppliedOnDevice {
    /// y = A x, four values a node.
    fn apply(&mut self, x: &Array<f64>, y: &mut Array<f64>) -> Result<(), DeviceError>;
}

/// A tangent that is applied without being assembled.
pub trait Product: std::fmt::Debug + Send {
    /// Takes over the tangent at an increment.
    fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted>;

    /// y = A x, on nodal values u_x, u_y, u_z, φ.
    fn apply(&mut self, x: &[[f64; 4]], y: &mut [[f64; 4]]);

    /// The diagonal, by node.
    fn diagonal(&mut self) -> Vec<[f64; 4]>;

    /// Adds the tangent of the linear functions on the same elements, whose nodes are the first
    /// four of each element: the level below quadratic elements.
    fn add_linear(&mut self, out: &mut Tangent);

    /// The same product on a device, if it is on one.
    fn on_device(&mut self) -> Option<&mut dyn AppliedOnDevice> {
        None
    }

    /// What the tangent takes in memory.
    #[cfg(feature = "bench-internals")]
    fn bytes(&self) -> usize;
}
