//! What can be wrong with a file that a run has written.

use std::sync::Arc;

/// Why a file is not the state of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Its bytes are not those that were written.
    #[error("is damaged: remove it to start again")]
    Damaged,
    /// It was written in another format.
    #[error("is a state of another version of this program: remove it to start again")]
    Version,
    /// It belongs to another problem.
    #[error("is the state of another test: remove it to start this one, or name another file")]
    OtherProblem,
}

/// Why a file is not a curve.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CurveFileError {
    /// A column that every curve has is absent.
    #[error("has no column '{column}': the header must hold {header}")]
    MissingColumn {
        /// The column.
        column: &'static str,
        /// All columns that are needed.
        header: String,
    },
    /// An entry that is not a number.
    #[error("line {line}, column '{column}': '{text}' is not a number")]
    NotANumber {
        /// The line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// Not a table: lines of unlike length, or bytes that are no text.
    #[error("is not a table: {0}")]
    NotATable(#[source] Arc<csv::Error>),
}
