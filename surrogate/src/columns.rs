//! Typed columns that describe the rows of a dataset. No fit uses them as inputs or outputs.

use crate::error::SurrogateError;

/// Meaning of a column, which also determines the type of its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Number of the run.
    Run,
    /// Number of the group, for example of a specimen: rows of one group share the unknown properties of the group. If
    /// there are several columns of groups, each row has at most one number in them.
    Group,
    /// Number of the batch in which the row was added to a design; empty for rows of the design.
    Batch,
    /// A property of the row that is known but is not an input; empty if it is unknown.
    Covariate,
    /// Cost of the run, for example its computing time.
    Cost,
}

impl Role {
    /// All roles, with the words that declare them in a file.
    const WORDS: [(Self, &str); 5] = [
        (Self::Run, "run"),
        (Self::Group, "group"),
        (Self::Batch, "batch"),
        (Self::Covariate, "covariate"),
        (Self::Cost, "cost"),
    ];

    /// The word that declares the role in a file.
    pub(crate) fn word(self) -> &'static str {
        let word = Self::WORDS.iter().find(|(role, _)| *role == self);
        word.map_or("", |(_, word)| word)
    }

    /// The role that a word of a file declares.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(_, other)| *other == word).map(|(role, _)| *role)
    }

    /// Whether the cells are whole numbers.
    fn is_whole(self) -> bool {
        matches!(self, Self::Run | Self::Group | Self::Batch)
    }
}

/// Name and role of a column that describes rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name, with the unit of a covariate or cost.
    pub name: String,
    /// Meaning of the column.
    pub role: Role,
}

impl Column {
    /// Creates a column. [`Dataset::with_columns`](crate::Dataset::with_columns) checks its name.
    pub fn new(role: Role, name: impl Into<String>) -> Self {
        Self { name: name.into(), role }
    }

    /// Rejects a cell of another type than the column.
    pub(crate) fn check(&self, cell: Cell) -> Result<(), SurrogateError> {
        let is_accepted = match cell {
            Cell::Empty => true,
            Cell::Whole(_) => self.role.is_whole(),
            Cell::Number(value) => !self.role.is_whole() && value.is_finite(),
        };
        if is_accepted { Ok(()) } else { Err(self.refused(&cell.to_text())) }
    }

    /// Reads a cell of this column.
    pub(crate) fn read(&self, text: &str) -> Result<Cell, SurrogateError> {
        if text.is_empty() {
            return Ok(Cell::Empty);
        }
        let cell = match self.role.is_whole() {
            true => text.parse().map(Cell::Whole).ok(),
            false => text.parse().map(Cell::Number).ok(),
        };
        let cell = cell.ok_or_else(|| self.refused(text))?;
        self.check(cell).map(|()| cell)
    }

    fn refused(&self, text: &str) -> SurrogateError {
        let expected = if self.role.is_whole() { "a whole number" } else { "a finite number" };
        SurrogateError::Cell { column: self.name.clone(), text: text.to_owned(), expected }
    }
}

/// Content of a cell in a column that describes rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Cell {
    /// The value is unknown, or there is none.
    #[default]
    Empty,
    /// A whole number: of a run, a group or a batch.
    Whole(u64),
    /// A finite number: a covariate or a cost.
    Number(f64),
}

impl Cell {
    /// The text of the cell in a file.
    pub(crate) fn to_text(self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Whole(value) => value.to_string(),
            Self::Number(value) => format!("{value:?}"),
        }
    }

    pub(crate) fn whole(self) -> Option<u64> {
        if let Self::Whole(value) = self { Some(value) } else { None }
    }

    pub(crate) fn number(self) -> Option<f64> {
        if let Self::Number(value) = self { Some(value) } else { None }
    }
}

impl From<u64> for Cell {
    fn from(value: u64) -> Self {
        Self::Whole(value)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}
