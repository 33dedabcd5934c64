//! The error type of this crate. Messages contain the location of the error, the wrong value and advice.

use std::path::PathBuf;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurrogateError {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A line of a CSV file is invalid.
    #[error("{}, line {line}: {source}", path.display())]
    InFile {
        /// Path of the file.
        path: PathBuf,
        /// Line number, from 1.
        line: u64,
        /// The error in this line.
        source: Box<SurrogateError>,
    },
    /// A surrogate file does not have the format that [`crate::DynPce::write`] writes.
    #[error("{}: not a surrogate file: {source}", path.display())]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// The error of the JSON parser, with line and column.
        source: serde_json::Error,
    },
    /// A line is not a CSV record, or a declaration is malformed.
    #[error("{problem}; {help}")]
    Syntax {
        /// Description of the problem.
        problem: String,
        /// Advice on the correct input.
        help: &'static str,
    },
    /// A cell does not contain a number.
    #[error("column `{column}`: `{text}` is not a number; write a number, for example 1.5e-3")]
    NotANumber {
        /// Name of the column.
        column: String,
        /// The cell's text.
        text: String,
    },
    /// A declared column is absent.
    #[error("column `{column}` is missing; the header has: {found}")]
    MissingColumn {
        /// Name of the declared column.
        column: String,
        /// Names of the columns in the header.
        found: String,
    },
    /// The columns of derivatives are incomplete.
    #[error(
        "column `{missing}` is missing although column `{there}` is present; give the derivatives of every output with respect to every input, or no derivatives"
    )]
    SomeDerivatives {
        /// Name of a column that is present.
        there: String,
        /// Name of a column that is missing.
        missing: String,
    },
    /// A name cannot be the header of a CSV column.
    #[error(
        "`{name}` cannot name a column; use visible text without line breaks that does not start with #"
    )]
    Name {
        /// The invalid name.
        name: String,
    },
    /// Two columns have the same name.
    #[error("the name `{name}` occurs twice; use different names for all inputs and outputs")]
    DuplicateName {
        /// The repeated name.
        name: String,
    },
    /// An interval is empty, reversed or not finite.
    #[error(
        "input `{input}` has the bounds [{lower}, {upper}]; give two finite numbers, the lower one first"
    )]
    Bounds {
        /// Name of the input.
        input: String,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A number on a logarithmic scale is zero or negative.
    #[error(
        "`{name}` has the value {value}, which has no logarithm; use values above 0, or a linear scale for `{name}`"
    )]
    Logarithm {
        /// Name of the output, or of the input whose lower bound is `value`.
        name: String,
        /// The number that has no logarithm.
        value: f64,
    },
    /// A name is neither the name of an input nor of an output.
    #[error("`{name}` is neither an input nor an output; the inputs and outputs are: {known}")]
    UnknownName {
        /// The unknown name.
        name: String,
        /// The names of all inputs and outputs.
        known: String,
    },
    /// A number of items, such as inputs, outputs or cells, differs from the expected number.
    #[error("expected {expected} {what}, found {found}")]
    Count {
        /// Name of the counted items, such as `outputs`; begins with `or more`, as in `or more outputs`, if `expected`
        /// is a minimum.
        what: &'static str,
        /// The number expected.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("column `{column}` = {value} is not finite; correct or remove the row")]
    NotFinite {
        /// Name of the column.
        column: String,
        /// The value.
        value: f64,
    },
    /// An input of a row lies outside its bounds.
    #[error(
        "column `{column}` = {value} lies outside its bounds [{lower}, {upper}]; correct the row or widen the bounds"
    )]
    OutsideBounds {
        /// Name of the input.
        column: String,
        /// The value.
        value: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// An output has the same value in every row, so that its relative error is undefined.
    #[error(
        "output `{output}` is {value} in every row; there is nothing to fit; remove this output"
    )]
    ConstantOutput {
        /// Name of the output.
        output: String,
        /// The value of the output in every row.
        value: f64,
    },
    /// An option is outside its allowed range.
    #[error("option {option} = {value} is not allowed; it must be {allowed}")]
    Option {
        /// The name of the option.
        option: &'static str,
        /// The value given.
        value: String,
        /// A description of the allowed values.
        allowed: String,
    },
    /// The rows do not determine the coefficients of the requested order.
    #[error(
        "order {order} has {terms} terms, which {rows} rows do not determine; add rows or lower the order"
    )]
    NotEstimable {
        /// The requested order.
        order: usize,
        /// The number of terms of the order.
        terms: usize,
        /// The number of rows.
        rows: usize,
    },
    /// A term of an expansion is invalid.
    #[error("term {index:?}: {problem}")]
    Term {
        /// Multi-index of the term.
        index: Vec<u8>,
        /// Description of the problem with the term.
        problem: String,
    },
    /// An input is outside the training box by more than the tolerance.
    #[error(
        "input `{input}` = {value} lies outside the training box [{lower}, {upper}] by more than {tolerance} of its width; train the surrogate on a wider box"
    )]
    OutsideBox {
        /// Name of the input.
        input: String,
        /// The value of the input.
        value: f64,
        /// Lower bound of the box.
        lower: f64,
        /// Upper bound of the box.
        upper: f64,
        /// Tolerance outside the box, as a fraction of the width of the input's interval.
        tolerance: f64,
    },
}
