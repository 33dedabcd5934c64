//! Parses tokens into the syntax tree. A statement with a syntax error becomes a statement of kind `Broken`, which
//! contains the error. A model with an unusable signature becomes a model without statements. Parsing continues after
//! either error.

mod attributes;
mod ending;
mod signature;
mod statements;

pub(crate) use signature::models;
