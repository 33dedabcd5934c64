//! Linear solvers for the tangent, behind one trait.

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
/// Expensive parts (factor, hierarchy) are reused as preconditioner for later tangents. The solver renews them when a
/// renewal saves time.
pub(crate) trait LinearSolver: Send {
    /// Sets the tangent to that of an increment. `free` marks the values that are solved for; all other values have
    /// d = 0.
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted>;

    /// Solves until the residual is at most `tolerance` times that of d = 0, in the norm Σ r_i²/|A_ii|. Entries of
    /// `right` at constrained values are not read.
    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular>;

    /// z ≈ A⁻¹ r for several right-hand sides, zero in constrained values, by the current factor or hierarchy.
    /// Returns the number of factors or hierarchies that had to be computed. z is NaN if a device that had the tangent
    /// has failed; the next tangent is computed on the processor.
    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32;

    /// y = A x with the rows and columns of all values, including constrained ones; NaN as in
    /// [`Self::precondition`].
    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]);

    /// Returns 1/|A_ii| for the values that are solved for, zero for all others: the weight of the norm.
    fn weight(&self) -> &[Nodal];

    /// Returns the iterations of the solution after which a factor replaces multigrid; `None` if multigrid is not
    /// replaced.
    fn gave_way_after(&self) -> Option<u32> {
        None
    }

    /// Uses a factor from the next tangent on, because an earlier solver of the run replaced multigrid after a
    /// solution with this number of iterations.
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

/// Work and accuracy of a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LinearEffort {
    /// Krylov iterations.
    pub(crate) iterations: u32,
    /// Number of factorisations or hierarchies computed.
    pub(crate) renewals: u32,
    /// Residual reached, relative to that of d = 0.
    pub(crate) residual: f64,
}

/// Error of a system without solution, or whose tangent was on a device that has failed, with the work of the attempt.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Singular(pub(crate) LinearEffort);
