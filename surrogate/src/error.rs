//! What can go wrong, with the place, the value and the help.

use std::path::PathBuf;

/// Everything that this crate refuses.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurrogateError {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file was read, but one of its lines is wrong.
    #[error("{}, line {line}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: u64,
        /// What is wrong there.
        source: Box<SurrogateError>,
    },
    /// A surrogate file is not what [`crate::DynPce::write`] writes.
    #[error("{}: not a surrogate file: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The parser's reason, with line and column.
        source: serde_json::Error,
    },
    /// A line that is no CSV record, or a malformed declaration.
    #[error("{problem}; {help}")]
    Syntax {
        /// What was found.
        problem: String,
        /// What to write instead.
        help: &'static str,
    },
    /// A cell that should hold a number holds something else.
    #[error("column `{column}`: `{text}` is not a number; write one, for example 1.5e-3")]
    NotANumber {
        /// The column.
        column: String,
        /// The cell's text.
        text: String,
    },
    /// A declared column is absent.
    #[error("column `{column}` is missing; the header has: {found}")]
    MissingColumn {
        /// The declared name.
        column: String,
        /// The names in the header.
        found: String,
    },
    /// Derivatives of some outputs in some inputs only.
    #[error(
        "column `{missing}` is missing although there is `{there}`; give the derivative of every output in every input, or none"
    )]
    SomeDerivatives {
        /// A column that is there.
        there: String,
        /// One that is not.
        missing: String,
    },
    /// A name that cannot head a CSV column.
    #[error(
        "`{name}` cannot name a column; use visible text without line breaks that does not start with #"
    )]
    Name {
        /// The refused name.
        name: String,
    },
    /// Two columns with one name.
    #[error("the name `{name}` occurs twice; give every input and output a name of its own")]
    DuplicateName {
        /// The repeated name.
        name: String,
    },
    /// An interval that is empty, reversed or not finite.
    #[error(
        "input `{input}` has the bounds [{lower}, {upper}]; give two finite numbers, the lower one first"
    )]
    Bounds {
        /// The input.
        input: String,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A logarithm of a number that has none.
    #[error(
        "`{name}` reaches {value}, which has no logarithm; raise it above 0 or leave `{name}` linear"
    )]
    Logarithm {
        /// The input, whose lower bound it is, or the output.
        name: String,
        /// The number.
        value: f64,
    },
    /// A name that is neither an input nor an output.
    #[error("`{name}` is neither an input nor an output; there are: {known}")]
    UnknownName {
        /// The name.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A number of inputs, outputs or cells other than the one expected.
    #[error("expected {expected} {what}, found {found}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// The number expected.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// NaN or an infinity where a number is needed.
    #[error("column `{column}` = {value} is not finite; correct or remove the row")]
    NotFinite {
        /// The column.
        column: String,
        /// The value.
        value: f64,
    },
    /// A row whose input lies outside its declared interval.
    #[error(
        "column `{column}` = {value} lies outside its bounds [{lower}, {upper}]; correct the row or widen the bounds"
    )]
    OutsideBounds {
        /// The input.
        column: String,
        /// The value.
        value: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// An output that is the same in every row has no relative error.
    #[error("output `{output}` is {value} in every row; there is nothing to fit, leave it out")]
    ConstantOutput {
        /// The output.
        output: String,
        /// Its one value.
        value: f64,
    },
    /// An option outside its range.
    #[error("option {option} = {value} is not allowed; it must be {allowed}")]
    Option {
        /// The option.
        option: &'static str,
        /// The value given.
        value: String,
        /// The values allowed.
        allowed: String,
    },
    /// The rows do not determine the coefficients of the order asked for.
    #[error(
        "order {order} has {terms} terms, which {rows} rows do not determine; add rows or lower the order"
    )]
    NotEstimable {
        /// The order.
        order: usize,
        /// Its number of terms.
        terms: usize,
        /// The number of rows.
        rows: usize,
    },
    /// Terms that do not make up an expansion.
    #[error("term {index:?}: {problem}")]
    Term {
        /// The multi-index.
        index: Vec<u8>,
        /// What is wrong with it.
        problem: String,
    },
    /// A surrogate was asked for a point too far outside its training box.
    #[error(
        "input `{input}` = {value} lies outside the training box [{lower}, {upper}] by more than {tolerance} of its width; train the surrogate on a wider box"
    )]
    OutsideBox {
        /// The input.
        input: String,
        /// The value.
        value: f64,
        /// Lower bound of the box.
        lower: f64,
        /// Upper bound of the box.
        upper: f64,
        /// Fraction of the width that is tolerated.
        tolerance: f64,
    },
}
