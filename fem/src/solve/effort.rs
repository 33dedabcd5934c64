//! Counters of the work of a solver.

use serde::{Deserialize, Serialize};

/// Work done by the solver in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effort {
    /// Newton iterations, each with one linear solve.
    pub iterations: u32,
    /// Iterations of the linear solver.
    pub linear: u32,
    /// Number of factorisations, plus the number of multigrid hierarchies that the iterative solver has created.
    pub factorisations: u32,
    /// Increments that were solved by another method because the selected scheme failed: by alternate minimisation, by
    /// a gradient flow of damage, or with gradually decreasing slip velocities of friction.
    pub fallbacks: u32,
    /// Number of load steps that failed and were repeated with a smaller step.
    pub cuts: u32,
    /// Number of iterations of the linear solve after which a sparse factor replaced multigrid; 0 if multigrid was not
    /// replaced.
    pub slow_solution: u32,
}
