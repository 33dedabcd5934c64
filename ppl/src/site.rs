//! Where a statement of a model stands, and what it leaves by.

use crate::density::{DomainError, FatalError, Location, Rejection};

/// A statement of a model: the name that it declares or observes, and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Name in posteriors and reports.
    pub name: &'static str,
    /// Source.
    pub location: Location,
    /// Whether it stands in a loop: its values are stacked then.
    pub repeated: bool,
    /// The names of the dimensions along which the loops around stack, the innermost last; empty
    /// if that has no name.
    pub plates: &'static [&'static str],
    /// Names of the value's own dimensions; empty for unnamed ones.
    pub dims: &'static [&'static str],
}

impl Site {
    /// A statement outside loops; for models written by hand.
    pub const fn new(name: &'static str) -> Self {
        Self::at(name, name, "", 0)
    }

    /// A statement in a source file; what `model!` writes.
    pub const fn at(
        name: &'static str,
        statement: &'static str,
        file: &'static str,
        line: u32,
    ) -> Self {
        let location = Location { statement, file, line };
        Self { name, location, repeated: false, plates: &[], dims: &[] }
    }

    /// The same in a loop.
    pub const fn in_loop(mut self) -> Self {
        self.repeated = true;
        self
    }

    /// The same in loops over the entries of these dimensions, the innermost last.
    pub const fn along(mut self, dimensions: &'static [&'static str]) -> Self {
        self.plates = dimensions;
        self.in_loop()
    }

    /// The same with names for the dimensions of its value.
    pub const fn dims(mut self, names: &'static [&'static str]) -> Self {
        self.dims = names;
        self
    }

    /// A result with this location in its error: `expr?` inside a model.
    ///
    /// # Errors
    /// [`rejection`](Site::rejection) of what `result` holds.
    pub fn locate<T>(&self, result: Result<T, impl Into<Failure>>) -> Result<T, Rejection> {
        result.map_err(|error| self.rejection(error))
    }

    /// The point rejected here for a reason of the model's own: `reject!`.
    pub fn reject(&self, message: String) -> Rejection {
        Rejection::Reject { location: self.location, message }
    }

    /// A product of vectors of different lengths, data and unknowns.
    #[cold]
    #[inline(never)]
    pub(crate) fn other_lengths(&self, data: usize, unknowns: usize) -> Rejection {
        Box::new(FatalError::DotLengths { location: self.location, data, unknowns }).into()
    }

    /// Attaches this location to what a user function returned by `?`.
    pub fn rejection(&self, error: impl Into<Failure>) -> Rejection {
        match error.into() {
            Failure::Domain(error) => {
                Rejection::Domain { location: self.location, error: Box::new(error) }
            }
            Failure::Rejection(rejection) => rejection,
        }
    }
}

/// What `?` may carry inside a model.
#[derive(Clone, Debug)]
pub enum Failure {
    /// A function that is not defined there.
    Domain(DomainError),
    /// A statement that has rejected already.
    Rejection(Rejection),
}

impl From<DomainError> for Failure {
    fn from(error: DomainError) -> Self {
        Self::Domain(error)
    }
}

impl From<Rejection> for Failure {
    fn from(rejection: Rejection) -> Self {
        Self::Rejection(rejection)
    }
}

impl From<DomainError> for Rejection {
    fn from(error: DomainError) -> Self {
        Self::Domain { location: Location::unknown(), error: Box::new(error) }
    }
}
