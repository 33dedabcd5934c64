//! Reasons for the failure of a load step.

/// Reason why an increment found no equilibrium. Residuals are relative, like `tolerance` in
/// [`SolverOptions`](crate::SolverOptions).
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepFailure {
    /// The initial guess or an intermediate state inverts an element.
    #[error("the start of the increment turns an element inside out")]
    Inverted,
    /// The energy of a law, or a force that follows from it, is not finite.
    #[error("the energy or the stress of a law is not finite in an intermediate state")]
    NotFinite,
    /// A prescribed value, a load, the motion of a platen or an initial guess is not finite.
    #[error("a function of the boundary conditions returns a value that is not finite")]
    Condition,
    /// No step along Newton's direction reduces the residual.
    #[error(
        "the line search found no smaller residual than {residual:.1e} after {iterations} iterations"
    )]
    Stalled {
        /// Number of Newton iterations of the failed attempt.
        iterations: u32,
        /// Relative residual at the end of the attempt.
        residual: f64,
    },
    /// The limit of iterations was reached.
    #[error("too many iterations: the residual is {residual:.1e} after {iterations} iterations")]
    TooManyIterations {
        /// Number of iterations of the failed attempt: Newton iterations, alternations, or steps of a gradient flow.
        iterations: u32,
        /// Relative residual at the end of the attempt.
        residual: f64,
    },
    /// The linear solver found no solution.
    #[error("the tangent is singular")]
    Singular,
    /// The limit of updates of the contact pressures (passes) was reached.
    #[error(
        "the contact pressures still change after {passes} passes, by {change:.1e} relative to the forces on the body"
    )]
    Contact {
        /// Number of updates of the contact pressures.
        passes: u32,
        /// Change of the contact forces in the last pass, relative to the forces on the body.
        change: f64,
    },
    /// The specimen does not carry the prescribed force.
    #[error(
        "the specimen does not carry the prescribed force of {prescribed_n:.4e} N: the force falls after {largest_n:.4e} N while the platen moves on"
    )]
    LimitLoad {
        /// Prescribed force, N.
        prescribed_n: f64,
        /// Largest force in the increment, N.
        largest_n: f64,
    },
    /// The specimen is damaged so far that only its residual stiffness carries the prescribed force.
    #[error(
        "the specimen does not carry the prescribed force of {prescribed_n:.4e} N: {:.0} % of the work of the step act on the residual stiffness of damaged material",
        100.0 * share
    )]
    ResidualStiffness {
        /// Prescribed force, N.
        prescribed_n: f64,
        /// Share of the work of the increment that acts on the residual stiffness.
        share: f64,
    },
    /// The step controller ended the run, although no step has failed.
    #[error("the step controller ended the run")]
    GivenUp,
    /// The crack energy of an arc-length step increased by more than the controller allows.
    #[error(
        "the crack energy increased by {released_n_mm:.3e} N mm in one step; an increase of at most {allowed_n_mm:.3e} N mm is allowed"
    )]
    Release {
        /// Increase of the crack energy in the step, N mm.
        released_n_mm: f64,
        /// Largest increase of the crack energy that the controller allows, N mm.
        allowed_n_mm: f64,
    },
}

impl StepFailure {
    /// Whether the specimen does not carry the force that a load program prescribes.
    pub(crate) fn exceeds_limit_load(&self) -> bool {
        matches!(self, Self::LimitLoad { .. } | Self::ResidualStiffness { .. })
    }
}
