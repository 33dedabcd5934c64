//! Counters of the work of a solver.

use serde::{Deserialize, Serialize};

/// Work done by the solver in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effort {
    /// Newton iterations, each with one linear solve.
    pub iterations: u32,
    /// Iterations of the linear solver.
    pub linear: u32,
    /// Number of factorisations, or of multigrid hierarchies of the iterative solver.
    pub factorisations: u32,
    /// Increments for which the selected scheme failed, so that they were solved by alternate minimisation, by a
    /// gradient flow of damage, or with gradually decreasing slip velocities of friction.
    pub fallbacks: u32,
    /// Load steps that were reduced.
    pub cuts: u32,
    /// Number of iterations of the linear solve after which a sparse factor replaced multigrid; 0 if multigrid was not
    /// replaced.
    pub slow_solution: u32,
}
