//! What a sampler sees of a model: a log density, its gradient, and why a point was rejected.

use std::fmt;

/// A log density on unconstrained space ℝᵈ.
///
/// [`Bound`](crate::Bound) implements it for every model; write it by hand for a density that
/// is not a model.
///
/// # Example
/// ```
/// use ppl::{LogDensity, Nuts, Rejection};
///
/// struct Normal;
/// impl LogDensity for Normal {
///     type Workspace = ();
///     fn dim(&self) -> usize {
///         1
///     }
///     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
///         Ok(-0.5 * y[0] * y[0])
///     }
///     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
///         g[0] = -y[0];
///         self.log_density(y, w)
///     }
/// }
///
/// ppl::check::gradient(&Normal, 7);
/// let run = Nuts::default().chains(2).warmup(300).draws(500).seed(7).run(&Normal)?;
/// assert_eq!(run.len(), 500);
/// # Ok::<(), ppl::SampleError>(())
/// ```
pub trait LogDensity: Sync {
    /// Memory that evaluations use again and again; one a thread.
    type Workspace: Default + Send;

    /// d.
    fn dim(&self) -> usize;

    /// Log density at `y` (length d), log-Jacobians included.
    ///
    /// # Errors
    /// [`Rejection`] where the density is zero or not defined.
    fn log_density(&self, y: &[f64], workspace: &mut Self::Workspace) -> Result<f64, Rejection>;

    /// Log density at `y`, with its gradient written to `gradient` (length d).
    ///
    /// # Errors
    /// [`Rejection`] where the density is zero or not defined.
    fn gradient(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Self::Workspace,
    ) -> Result<f64, Rejection>;

    /// What can be said about a rejected `y` beyond the [`Rejection`], as the datum at fault; for
    /// error messages.
    fn explain(&self, y: &[f64]) -> Option<String> {
        let _ = y;
        None
    }
}

/// A statement of a model: where it stands and how it reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place {
    /// The statement as written, shortened.
    pub statement: &'static str,
    /// Source file.
    pub file: &'static str,
    /// Line in it.
    pub line: u32,
}

impl Place {
    /// For densities that are not made of statements.
    pub const fn unknown() -> Self {
        Self { statement: "log density", file: "", line: 0 }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.file.is_empty() {
            write!(f, "`{}`", self.statement)
        } else {
            write!(f, "`{}` ({}:{})", self.statement, self.file, self.line)
        }
    }
}

/// Why a point has no density.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Rejection {
    /// A term is NaN or infinite.
    #[error("log density is {value} at {place}")]
    NotFinite {
        /// The statement whose term it is.
        place: Place,
        /// The term.
        value: f64,
    },
    /// A function or a distribution is not defined there.
    #[error("{error} at {place}")]
    Domain {
        /// The statement that called it.
        place: Place,
        /// What it said.
        #[source]
        error: Box<DomainError>,
    },
    /// The model said `reject!`.
    #[error("rejected at {place}: {message}")]
    Reject {
        /// The statement.
        place: Place,
        /// The model's words.
        message: String,
    },
    /// Nothing can be evaluated any more: the run stops and keeps its draws.
    #[error("{message}")]
    Fatal {
        /// What happened.
        message: String,
    },
}

impl Rejection {
    /// The statement that rejected, if the run can go on.
    pub fn place(&self) -> Option<Place> {
        match self {
            Self::NotFinite { place, .. }
            | Self::Domain { place, .. }
            | Self::Reject { place, .. } => Some(*place),
            Self::Fatal { .. } => None,
        }
    }
}

/// An argument outside the domain of a distribution or of a function: "Normal: sd must be positive
/// and finite, got -1".
///
/// Functions that say why in words of their own leave `parameter` empty: see
/// [`new`](DomainError::new).
#[derive(Clone, Debug, PartialEq)]
pub struct DomainError {
    /// Which distribution or function refuses; may be empty.
    pub distribution: &'static str,
    /// Which of its arguments is at fault.
    pub parameter: Box<str>,
    /// What it must be.
    pub requirement: Box<str>,
    /// What it is.
    pub value: f64,
}

impl fmt::Display for DomainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { distribution, parameter, requirement, value } = self;
        if !distribution.is_empty() {
            write!(f, "{distribution}: ")?;
        }
        if parameter.is_empty() {
            return f.write_str(requirement);
        }
        write!(f, "{parameter} must be {requirement}, got {value}")
    }
}

impl std::error::Error for DomainError {}

impl DomainError {
    /// In words, which name the argument, its value and what is required.
    pub fn new(message: impl Into<Box<str>>) -> Self {
        Self {
            distribution: "",
            parameter: "".into(),
            requirement: message.into(),
            value: f64::NAN,
        }
    }

    /// Of an argument that does not meet a requirement.
    #[cold]
    pub fn unmet(
        distribution: &'static str,
        parameter: impl fmt::Display,
        requirement: impl fmt::Display,
        value: f64,
    ) -> Self {
        Self {
            distribution,
            parameter: parameter.to_string().into(),
            requirement: requirement.to_string().into(),
            value,
        }
    }

    /// Demands that `holds`.
    ///
    /// # Errors
    /// The demand, if it does not hold.
    pub fn require(
        holds: bool,
        distribution: &'static str,
        parameter: impl fmt::Display,
        requirement: impl fmt::Display,
        value: f64,
    ) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::unmet(distribution, parameter, requirement, value)) }
    }

    /// Demands a finite number.
    ///
    /// # Errors
    /// The demand, if it does not hold.
    pub fn require_finite(
        distribution: &'static str,
        parameter: impl fmt::Display,
        value: f64,
    ) -> Result<(), Self> {
        Self::require(value.is_finite(), distribution, parameter, "finite", value)
    }

    /// Demands a positive, finite number.
    ///
    /// # Errors
    /// The demand, if it does not hold.
    pub fn require_positive(
        distribution: &'static str,
        parameter: impl fmt::Display,
        value: f64,
    ) -> Result<(), Self> {
        let holds = value > 0.0 && value.is_finite();
        Self::require(holds, distribution, parameter, "positive and finite", value)
    }
}
