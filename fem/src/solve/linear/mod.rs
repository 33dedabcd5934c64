//! Linear solvers for the tangent, with a common trait.

mod adaptive;
mod direct;
mod in_memory;
mod iterative;
mod krylov;
mod multigrid;
mod on_device;
mod plan;
mod vectors;

pub(crate) use in_memory::Nodal;
pub(super) use in_memory::{CHUNK, add_scaled, mask, weighted_dot};
pub(crate) use plan::LinearPlan;

use crate::material::Inverted;
use crate::operator::{Coupling, Increment};

/// Solves A d = r with the consistent tangent A, on nodal values u_x, u_y, u_z, φ.
///
/// The factor or multigrid hierarchy, which is expensive, is reused as preconditioner for later tangents. The solver
/// renews the factor or hierarchy when the renewal saves time.
pub(crate) trait LinearSolver: Send {
    /// Computes and stores the tangent of an increment. `free` marks the unknown values. For all other (constrained)
    /// values, the solution d is zero.
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted>;

    /// Solves A d = r until the norm of the residual is at most `tolerance` times the norm of r. The norm is √(Σ
    /// r_i²/|A_ii|). Entries of `right` at constrained values are not read.
    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular>;

    /// Computes z ≈ A⁻¹ r for several right-hand sides r by the current factor or hierarchy; z is zero in constrained
    /// values. Returns the number of factors or hierarchies that had to be computed.
    ///
    /// z is NaN if the device that stored the tangent has failed; the next tangent is then computed on the processor.
    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32;

    /// Computes y = A x with the rows and columns of all values, including constrained values. y is NaN under the same
    /// condition as z in [`Self::precondition`].
    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]);

    /// Returns the weights of the norm: 1/|A_ii| for the free values, zero for the constrained values.
    fn weight(&self) -> &[Nodal];

    /// Returns the number of iterations of the solve after which a factor replaces multigrid; `None` if multigrid is
    /// not replaced.
    fn gave_way_after(&self) -> Option<u32> {
        None
    }

    /// Replaces multigrid by a factor from the next tangent on, because an earlier solver of the run replaced multigrid
    /// after a solve with this number of iterations.
    fn give_way(&mut self, _iterations: u32) {}

    /// Whether the systems are solved on a device.
    fn is_on_device(&self) -> bool {
        false
    }

    /// Describes the hardware that solves the systems, as text.
    fn machine(&self) -> String {
        "the processor".into()
    }
}

/// Work and accuracy of a linear solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LinearEffort {
    /// Krylov iterations.
    pub(crate) iterations: u32,
    /// Number of factors or multigrid hierarchies that were computed.
    pub(crate) renewals: u32,
    /// Norm of the residual at the end, divided by the norm of the right-hand side.
    pub(crate) residual: f64,
}

/// Error of a linear solve: the system has no solution, or the device that stored the tangent has failed. The field is
/// the work of the failed solve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Singular(pub(crate) LinearEffort);
