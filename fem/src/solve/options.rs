//! How an increment is solved.

use serde::{Deserialize, Serialize};

use crate::error::FemError;

/// The order in which the two fields are solved for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Displacement and damage together by Newton; alternate minimisation where that fails.
    #[default]
    Monolithic,
    /// Displacement and damage in turn until both are in equilibrium: slow but sturdy.
    Alternate,
}

/// What solves the linear systems of Newton's iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinearScheme {
    /// Chosen by the number of unknowns.
    #[default]
    Auto,
    /// A sparse factor, kept as preconditioner while it pays.
    Direct,
    /// Krylov iterations, preconditioned by algebraic multigrid: memory grows as the mesh does.
    Multigrid,
}

/// Settings of the solver; the default is meant to be left alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverOptions {
    /// Which fields are solved together.
    pub scheme: Scheme,
    /// What solves the linear systems.
    pub linear: LinearScheme,
    /// Largest residual of a converged increment, relative to the largest reactions so far (displacement) and to
    /// the largest driving force so far (damage). What rounding leaves counts as converged.
    pub tolerance: f64,
    /// Part of the residual that the linear solution of an iteration may leave. With a thousandth, iterations hardly
    /// depend on how linear systems are solved, so that any number of ranks takes as many but for one or two; a quarter
    /// more linear iterations is what that costs.
    pub linear_tolerance: f64,
    /// Most Newton iterations of an increment.
    pub iterations: u32,
    /// Most alternations of an increment.
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
    /// Refuses settings out of their range.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
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
