//! Why a load step failed.

/// Why an increment found no equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StepFailure {
    /// The guess or a state on the way turns an element inside out.
    #[error("the start of the increment turns an element inside out")]
    Inverted,
    /// The energy of a law, or a force that follows from it, is not a finite number.
    #[error("the energy or the stress of a law is not finite there")]
    NotFinite,
    /// A prescribed value, a load, the motion of a platen or a first guess is not a finite number.
    #[error("a function of the boundary conditions returns a value that is not finite")]
    Condition,
    /// No step along Newton's direction lowers the residual.
    #[error("the line search found no smaller residual")]
    Stalled,
    /// The iterations ran out.
    #[error("too many iterations")]
    TooManyIterations,
    /// The linear solver found no solution.
    #[error("the tangent is singular")]
    Singular,
    /// The passes over the contact pressures ran out.
    #[error("the contact pressures did not settle")]
    Contact,
    /// The step controller ended the run, which had found every equilibrium so far.
    #[error("the step controller gave up")]
    GivenUp,
    /// The step added more crack energy than an arc-length step may.
    #[error("the step released more energy than asked for")]
    Release,
}
