//! Errors of the files that a run writes.

use std::sync::Arc;

/// Error of a checkpoint file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The content of the file was changed or truncated.
    #[error("the file is damaged: delete the file to start the test from the beginning")]
    Damaged,
    /// The file has the format of another version of this program.
    #[error(
        "the file was written by another version of this program: delete the file to start the test from the beginning"
    )]
    Version,
    /// The file belongs to another problem.
    #[error(
        "the file contains the state of another test: delete the file to start this test, or give another file name"
    )]
    OtherProblem,
}

/// Error of a curve file.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CurveFileError {
    /// A mandatory column is missing.
    #[error("the table has no column '{column}': its header must contain {header}")]
    MissingColumn {
        /// Name of the missing column.
        column: &'static str,
        /// Names of all mandatory columns.
        header: String,
    },
    /// An entry that is not a number.
    #[error("line {line}, column '{column}': '{text}' is not a number: correct this entry")]
    NotANumber {
        /// Line number, from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// Text of the entry.
        text: String,
    },
    /// The file is not a table: the number of columns varies, or the bytes are not text.
    #[error("the file is not a table of comma-separated values: {0}")]
    NotATable(#[source] Arc<csv::Error>),
}
