//! Errors of files written by a run.

use std::sync::Arc;

/// Error of a checkpoint file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The content of the file was changed or truncated.
    #[error("is damaged: remove it to start again")]
    Damaged,
    /// The file has the format of another version.
    #[error("is a state of another version of this program: remove it to start again")]
    Version,
    /// The file belongs to another problem.
    #[error("is the state of another test: remove it to start this one, or name another file")]
    OtherProblem,
}

/// Error of a curve file.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CurveFileError {
    /// A mandatory column is missing.
    #[error("has no column '{column}': the header must hold {header}")]
    MissingColumn {
        /// Name of the missing column.
        column: &'static str,
        /// Names of all mandatory columns.
        header: String,
    },
    /// An entry that is not a number.
    #[error("line {line}, column '{column}': '{text}' is not a number")]
    NotANumber {
        /// Line number, from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// Text of the entry.
        text: String,
    },
    /// The file is not a table: the number of columns varies, or the bytes are not text.
    #[error("is not a table: {0}")]
    NotATable(#[source] Arc<csv::Error>),
}
