//! Counters of the work of a solver.

use serde::{Deserialize, Serialize};

/// Work done by the solver in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effort {
    /// Newton iterations (linear solves).
    pub iterations: u32,
    /// Iterations of the linear solver.
    pub linear: u32,
    /// Factorisations, or hierarchies of the iterative solver.
    pub factorisations: u32,
    /// Increments that were solved by alternate minimisation, by a flow of damage, or with friction that is applied
    /// gradually.
    pub fallbacks: u32,
    /// Load steps that were reduced.
    pub cuts: u32,
    /// Iterations of the solution after which a sparse factor replaced multigrid; 0 if multigrid was not replaced.
    pub slow_solution: u32,
}
