//! Reasons why a point has no density.

use std::error::Error;
use std::fmt;
use std::sync::Arc;

use crate::density::domain_error::DomainError;

/// A statement of a model: its source text and position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Location {
    /// Source text of the statement, shortened.
    pub statement: &'static str,
    /// Source file.
    pub file: &'static str,
    /// Line number in the source file.
    pub line: u32,
}

impl Location {
    /// Location for densities that do not consist of statements.
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

/// Reason why a point has no density.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Rejection {
    /// A term of the log density is NaN or infinite.
    #[error("log density is {value} at {location}")]
    NotFinite {
        /// Statement that contributes the term.
        location: Location,
        /// Value of the term.
        value: f64,
    },
    /// A function or distribution was called outside its domain.
    #[error("{error} at {location}")]
    Domain {
        /// Statement that called the function or distribution.
        location: Location,
        /// Error of the function or distribution.
        #[source]
        error: Box<DomainError>,
    },
    /// The model executed `reject!`.
    #[error("rejected at {location}: {message}")]
    Reject {
        /// The `reject!` statement.
        location: Location,
        /// Message of the `reject!` statement.
        message: String,
    },
    /// A fatal error, after which no further evaluation is possible. The run of the sampler stops and keeps its
    /// draws.
    #[error(transparent)]
    Fatal(#[from] Box<FatalError>),
}

impl Rejection {
    /// Creates a rejection that ends the run of the sampler, for example because an external service failed. `cause`
    /// is an error or a message.
    pub fn fatal(cause: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Fatal(Box::new(FatalError::other(cause)))
    }

    /// Statement that rejected the point; `None` for a fatal error.
    pub fn location(&self) -> Option<Location> {
        match self {
            Self::NotFinite { location, .. }
            | Self::Domain { location, .. }
            | Self::Reject { location, .. } => Some(*location),
            Self::Fatal(_) => None,
        }
    }
}

/// Error after which no further evaluation is possible. All variants except the last are errors in a model or in its
/// call.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FatalError {
    /// A prediction statement was executed while the log density was evaluated.
    #[error("{location}: predictions need `if cx.predicts()` around them")]
    Prediction {
        /// The prediction statement.
        location: Location,
    },
    /// The model executed more observation statements than when its data were bound.
    #[error(
        "{location}: the model executes more observation statements than when its data were bound; the number \
         of observations must depend only on data"
    )]
    MoreObservations {
        /// First additional observation statement.
        location: Location,
    },
    /// The number of unknowns and the number of coordinates differ.
    #[error(
        "the number of unknowns depends on the values of unknowns, or the length of the point differs from \
         `dim()`: {}; the number of unknowns must depend only on data",
        coordinates_left(.location)
    )]
    VaryingDimension {
        /// Statement that needs more coordinates than are left; `None` if some coordinates were not used.
        location: Option<Location>,
    },
    /// A distribution read a number of coordinates that differs from its `dim()`.
    #[error(
        "{location}: the distribution reads a number of coordinates that differs from its `dim()`, {dim}"
    )]
    OtherDimension {
        /// Statement with the distribution.
        location: Location,
        /// Value of `dim()`.
        dim: usize,
    },
    /// A dot product has vectors of different lengths.
    #[error(
        "{location}: `dot` multiplies {data} data with {unknowns} unknowns: both must have the same length"
    )]
    DotLengths {
        /// Statement with the dot product.
        location: Location,
        /// Number of data.
        data: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// A point has a length that differs from the number of coordinates of the density.
    #[error(
        "the point has length {point} and the density has {dim} coordinates: both must be equal; a kernel must \
         evaluate and move to points of length `ChainState::dim()`, and `LogDensity::prior_point` must return points of \
         length `dim()`"
    )]
    PointLength {
        /// Length of the point.
        point: usize,
        /// Number of coordinates of the density.
        dim: usize,
    },
    /// Gradient and point have different lengths.
    #[error(
        "the gradient has length {gradient} and the point has length {point}: both must have the same length"
    )]
    GradientLength {
        /// Length of the gradient.
        gradient: usize,
        /// Length of the point.
        point: usize,
    },
    /// A name is used for two quantities, or the values of a name change their shape.
    #[error("{location}: the name `{name}` {problem}")]
    Name {
        /// Statement with the name.
        location: Location,
        /// Name of the quantity.
        name: String,
        /// Description of the problem.
        problem: String,
    },
    /// Named dimensions are inconsistent.
    #[error("{problem}")]
    Dimensions {
        /// The dimension and the inconsistency.
        problem: String,
    },
    /// The code of the model panicked, for example because of an index out of bounds.
    #[error(
        "the model panics{}: {message}; check the data that the model reads there",
        at_or_after(.location)
    )]
    Panic {
        /// Last statement executed before the panic.
        location: Option<Location>,
        /// Message of the panic.
        message: String,
    },
    /// A fatal error of a user-defined density, created by [`Rejection::fatal`].
    #[error(transparent)]
    Other(#[from] OtherError),
}

impl FatalError {
    /// Fatal error from a user-defined error or message.
    pub(crate) fn other(cause: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Other(OtherError(Arc::from(cause.into())))
    }
}

fn coordinates_left(location: &Option<Location>) -> String {
    match location {
        Some(location) => format!("{location} needs more coordinates than remain"),
        None => "the model does not use all coordinates".to_owned(),
    }
}

fn at_or_after(location: &Option<Location>) -> String {
    location.map_or(String::new(), |location| format!(" at or after {location}"))
}

/// User-defined error. Two errors are equal if their messages are equal.
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
