//! Linear solvers for the tangent, behind one trait.

mod adaptive;
mod aggregation;
mod amg;
mod block_csr;
mod chebyshev;
mod coarse_nodes;
mod cover;
mod direct;
mod factor;
mod field_split;
mod iterative;
mod krylov;
mod on_device;
mod ordering;
mod plan;
mod quadratic;
mod rows;
mod vector;

pub(crate) use plan::LinearPlan;
pub(crate) use vector::Nodal;
pub(super) use vector::{CHUNK, add_scaled, mask, weighted_dot};

use crate::material::Inverted;
use crate::operator::{Coupling, Increment};

/// Solves A d = r with the consistent tangent A, on nodal values u_x, u_y, u_z, φ.
///
/// What is expensive (a factor, a hierarchy) is kept from one tangent to the next and serves as
/// preconditioner; the solver renews it where it no longer pays.
pub(crate) trait LinearSolver: Send {
    /// Takes over the tangent at an increment. `free` marks the values that are solved for; the
    /// others keep d = 0.
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted>;

    /// Solves until the residual is `tolerance` times that of d = 0, in the norm Σ r_i²/|A_ii|.
    /// Entries of `right` at constrained values are not read.
    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular>;

    /// z ≈ A⁻¹ r for several right-hand sides, zero in constrained values, by the factor or the hierarchy at
    /// hand; returns how many of these had to be made.
    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32;

    /// y = A x with the rows and columns of all values, those of supports and bounds too.
    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]);

    /// 1/|A_ii| of the values that are solved for, zero in the others: the weight of the norm.
    fn weight(&self) -> &[Nodal];

    /// Iterations of the solution after which multigrid gives way to a factor; `None` while it does not.
    fn gave_way_after(&self) -> Option<u32> {
        None
    }

    /// Uses a factor from the next tangent on, since an earlier solver of the run has come to that after a solution
    /// of so many iterations.
    fn give_way(&mut self, _iterations: u32) {}

    /// Whether the systems are solved on a device.
    fn is_on_device(&self) -> bool {
        false
    }

    /// Where the systems are solved, in words.
    fn machine(&self) -> String {
        "the processor".into()
    }
}

/// What a solution took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LinearEffort {
    /// Krylov iterations.
    pub(crate) iterations: u32,
    /// Factorisations or hierarchies made.
    pub(crate) renewals: u32,
    /// Residual reached, relative to that of d = 0.
    pub(crate) residual: f64,
}

/// No solver found a solution, and what the attempt took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Singular(pub(crate) LinearEffort);
