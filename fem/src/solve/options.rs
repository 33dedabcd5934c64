//! Options of the solution of an increment.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::FemError;

/// Scheme that solves for displacement and damage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Newton's method for displacement and damage together; alternate minimisation if Newton's method fails.
    #[default]
    Monolithic,
    /// Alternate minimisation: displacement at fixed damage, then damage at fixed displacement, repeatedly. This scheme
    /// is slow but robust.
    Alternate,
}

/// Method for the linear systems of Newton iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LinearScheme {
    /// `Direct` or `Multigrid`, depending on the number of unknowns.
    #[default]
    Auto,
    /// Sparse factor, reused as preconditioner while this is faster than a new factor.
    Direct,
    /// Krylov iterations, preconditioned by algebraic multigrid. The memory is proportional to the number of elements.
    Multigrid,
}

/// Settings of the solver; the defaults rarely need a change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverOptions {
    /// Scheme that solves for displacement and damage.
    pub scheme: Scheme,
    /// Method for the linear systems.
    pub linear: LinearScheme,
    /// Largest relative residual of a converged increment. The force residual is relative to the largest reactions so
    /// far, the damage residual to the largest driving force so far. Residuals of the size of rounding errors count as
    /// converged.
    #[schemars(range(min = 1e-14, max = 1e-2))]
    pub tolerance: f64,
    /// Relative residual of the linear solution in a Newton iteration. The value 1e-2 is fastest. The value 1e-3 needs
    /// about 25 % more linear iterations, but makes the number of Newton iterations nearly independent of the linear
    /// solver and of the number of ranks.
    #[schemars(range(min = 1e-12, max = 0.1))]
    pub linear_tolerance: f64,
    /// Largest number of Newton iterations per increment.
    #[schemars(range(min = 1, max = u32::MAX))]
    pub iterations: u32,
    /// Largest number of alternations of alternate minimisation per increment.
    #[schemars(range(min = 1, max = u32::MAX))]
    pub alternations: u32,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            scheme: Scheme::Monolithic,
            linear: LinearScheme::Auto,
            tolerance: 1e-8,
            linear_tolerance: 1e-2,
            iterations: 30,
            alternations: 400,
        }
    }
}

impl SolverOptions {
    /// Checks that all settings are in their ranges.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`].
    pub fn validate(&self) -> Result<(), FemError> {
        if !(1e-14..=1e-2).contains(&self.tolerance) {
            return Err(FemError::parameter(
                "solver",
                "tolerance",
                self.tolerance,
                "between 1e-14 and 1e-2, usually 1e-8",
            ));
        }
        if !(1e-12..=0.1).contains(&self.linear_tolerance) {
            return Err(FemError::parameter(
                "solver",
                "linear_tolerance",
                self.linear_tolerance,
                "between 1e-12 and 0.1, usually 1e-2",
            ));
        }
        for (field, value) in [("iterations", self.iterations), ("alternations", self.alternations)]
        {
            if value == 0 {
                return Err(FemError::parameter("solver", field, 0.0, "at least 1"));
            }
        }
        Ok(())
    }
}
