//! What a sampler sees of a model: a log density, its gradient, and why a point was rejected.

use std::error::Error;
use std::fmt;
use std::sync::Arc;

use rand::RngCore;

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

    /// A draw from the prior in unconstrained coordinates, if the density has a prior: chains and searches
    /// start there where uniform starts are rejected, and random walks take their first scales from it.
    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>> {
        let _ = rng;
        None
    }

    /// `y` with the quantities of these names at these values.
    ///
    /// # Errors
    /// Which name or value does not fit, and what would.
    #[doc(hidden)]
    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String> {
        let _ = (y, values);
        Err("a density without a model has no named quantities: give `init_points`".to_owned())
    }

    /// What can be said about a rejected `y` beyond the [`Rejection`], as the datum at fault; for
    /// error messages.
    fn explain(&self, y: &[f64]) -> Option<String> {
        let _ = y;
        None
    }
}

/// A statement of a model: where it stands and how it reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Location {
    /// The statement as written, shortened.
    pub statement: &'static str,
    /// Source file.
    pub file: &'static str,
    /// Line in it.
    pub line: u32,
}

impl Location {
    /// For densities that are not made of statements.
    pub const fn unknown() -> Self {
        Self { statement: "log density", file: "", line: 0 }
    }
}

impl fmt::Display for Location {
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
    #[error("log density is {value} at {location}")]
    NotFinite {
        /// The statement whose term it is.
        location: Location,
        /// The term.
        value: f64,
    },
    /// A function or a distribution is not defined there.
    #[error("{error} at {location}")]
    Domain {
        /// The statement that called it.
        location: Location,
        /// What it said.
        #[source]
        error: Box<DomainError>,
    },
    /// The model said `reject!`.
    #[error("rejected at {location}: {message}")]
    Reject {
        /// The statement.
        location: Location,
        /// The model's words.
        message: String,
    },
    /// Nothing can be evaluated any more: the run stops and keeps its draws.
    #[error(transparent)]
    Fatal(#[from] Box<FatalError>),
}

impl Rejection {
    /// Ends the run, as where a density asks a service that is gone: `cause` is an error, or words.
    pub fn fatal(cause: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Fatal(Box::new(FatalError::other(cause)))
    }

    /// The statement that rejected, if the run can go on.
    pub fn location(&self) -> Option<Location> {
        match self {
            Self::NotFinite { location, .. }
            | Self::Domain { location, .. }
            | Self::Reject { location, .. } => Some(*location),
            Self::Fatal(_) => None,
        }
    }
}

/// Why nothing can be evaluated any more. All but the last are mistakes in a model, or in how it is
/// called.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FatalError {
    /// A prediction was asked for where none can be made.
    #[error("{location}: predictions need `if cx.predicts()` around them")]
    Prediction {
        /// The statement.
        location: Location,
    },
    /// More observations than when the data were bound.
    #[error(
        "{location}: the model observes more often than when its data were bound; make that a matter of \
         data"
    )]
    MoreObservations {
        /// The first statement too many.
        location: Location,
    },
    /// An unknown past the last coordinate, or coordinates past the last unknown.
    #[error(
        "the number of unknowns depends on the values of unknowns, or the point has another length \
         than `dim()`: {}; make the size of the model a matter of data",
        coordinates_left(.location)
    )]
    VaryingDimension {
        /// The statement that asks for more than there is; `None` where coordinates are left over.
        location: Option<Location>,
    },
    /// A distribution that contradicts itself.
    #[error(
        "{location}: its distribution takes another number of coordinates than its `dim()`, {dim}"
    )]
    OtherDimension {
        /// The statement.
        location: Location,
        /// What `dim()` says.
        dim: usize,
    },
    /// A product of vectors of different lengths.
    #[error(
        "{location}: `dot` multiplies {data} data with {unknowns} unknowns: give them one length"
    )]
    DotLengths {
        /// The statement.
        location: Location,
        /// Number of data.
        data: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// A gradient of another length than the point.
    #[error(
        "the gradient has room for {gradient} numbers, the point has {point}: give them one length"
    )]
    GradientLength {
        /// Room for the gradient.
        gradient: usize,
        /// Coordinates of the point.
        point: usize,
    },
    /// A name that stands for two things, or whose values change their shape.
    #[error("{location}: the name `{name}` {problem}")]
    Name {
        /// The statement.
        location: Location,
        /// The name.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Named dimensions that contradict each other.
    #[error("{problem}")]
    Dimensions {
        /// Which, and how.
        problem: String,
    },
    /// The model's own code panicked, at an index out of bounds for example.
    #[error(
        "the model panics{}: {message}; compare the data that it reads there",
        at_or_after(.location)
    )]
    Panic {
        /// The last statement before.
        location: Option<Location>,
        /// What it said.
        message: String,
    },
    /// What a density of the user's said, by [`Rejection::fatal`].
    #[error(transparent)]
    Other(#[from] OtherError),
}

impl FatalError {
    /// An error of the user's own, or words.
    pub(crate) fn other(cause: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Other(OtherError(Arc::from(cause.into())))
    }
}

fn coordinates_left(location: &Option<Location>) -> String {
    match location {
        Some(location) => format!("{location} asks for more than the point has"),
        None => "the model stops asking before the last coordinate".to_owned(),
    }
}

fn at_or_after(location: &Option<Location>) -> String {
    location.map_or(String::new(), |location| format!(" at or after {location}"))
}

/// An error of the user's own; two are the same if they say the same.
#[derive(Clone, Debug)]
pub struct OtherError(Arc<dyn Error + Send + Sync>);

impl PartialEq for OtherError {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl fmt::Display for OtherError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Error for OtherError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        Some(&*self.0)
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

impl Error for DomainError {}

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
