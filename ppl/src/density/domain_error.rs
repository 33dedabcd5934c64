//! Errors of arguments outside the domain of a distribution or function.

use std::error::Error;
use std::fmt;

/// Error of an argument outside the domain of a distribution or function, such as "Normal: sd must be positive and
/// finite, got -1".
///
/// If the function provides the whole message, `parameter` is empty: see [`new`](DomainError::new).
#[derive(Clone, Debug, PartialEq)]
pub struct DomainError {
    /// Name of the distribution or function; may be empty.
    pub distribution: &'static str,
    /// Name of the invalid argument.
    pub parameter: Box<str>,
    /// Requirement on the argument, or the whole message.
    pub requirement: Box<str>,
    /// Value of the argument.
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
    /// Error with a complete message, which should name the argument, its value and the requirement.
    pub fn new(message: impl Into<Box<str>>) -> Self {
        Self {
            distribution: "",
            parameter: "".into(),
            requirement: message.into(),
            value: f64::NAN,
        }
    }

    /// Error of an argument that does not meet a requirement.
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

    /// Checks a requirement.
    ///
    /// # Errors
    /// [`DomainError`] with the requirement if `holds` is false.
    pub fn require(
        holds: bool,
        distribution: &'static str,
        parameter: impl fmt::Display,
        requirement: impl fmt::Display,
        value: f64,
    ) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::unmet(distribution, parameter, requirement, value)) }
    }

    /// Checks that a value is finite.
    ///
    /// # Errors
    /// [`DomainError`] if the value is not finite.
    pub fn require_finite(
        distribution: &'static str,
        parameter: impl fmt::Display,
        value: f64,
    ) -> Result<(), Self> {
        Self::require(value.is_finite(), distribution, parameter, "finite", value)
    }

    /// Checks that a value is positive and finite.
    ///
    /// # Errors
    /// [`DomainError`] if the value is not positive and finite.
    pub fn require_positive(
        distribution: &'static str,
        parameter: impl fmt::Display,
        value: f64,
    ) -> Result<(), Self> {
        let holds = value > 0.0 && value.is_finite();
        Self::require(holds, distribution, parameter, "positive and finite", value)
    }
}
