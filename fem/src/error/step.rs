//! Reasons for the failure of a load step.

/// Reason why an increment found no equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StepFailure {
    /// The initial guess or an intermediate state inverts an element.
    #[error("the start of the increment turns an element inside out")]
    Inverted,
    /// The energy of a law, or a force that follows from it, is not finite.
    #[error("the energy or the stress of a law is not finite there")]
    NotFinite,
    /// A prescribed value, a load, the motion of a platen or an initial guess is not finite.
    #[error("a function of the boundary conditions returns a value that is not finite")]
    Condition,
    /// No step along Newton's direction reduces the residual.
    #[error("the line search found no smaller residual")]
    Stalled,
    /// The limit of iterations was reached.
    #[error("too many iterations")]
    TooManyIterations,
    /// The linear solver found no solution.
    #[error("the tangent is singular")]
    Singular,
    /// The limit of passes over the contact pressures was reached.
    #[error("the contact pressures did not settle")]
    Contact,
    /// The step controller ended the run, although every step so far found an equilibrium.
    #[error("the step controller gave up")]
    GivenUp,
    /// The step released more crack energy than an arc-length step may release.
    #[error("the step released more energy than asked for")]
    Release,
}
