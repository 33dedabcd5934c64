//! Generates readable Rust from the syntax tree and the analyses.
//!
//! Names that the macro introduces have mixed-site spans, so that they differ from variables of the user with
//! the same name, such as `cx`. Tokens of the user are emitted unchanged.

mod function;
mod statements;

pub(crate) use function::function;
