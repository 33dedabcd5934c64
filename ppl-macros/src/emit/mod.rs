//! From a plan to Rust that a person can follow.
//!
//! Names of the macro's own have mixed-site spans: variables of a user called `cx` are others.
//! Tokens of the user are handed on as they are.

mod data;
mod function;
mod names;
mod statements;

pub(crate) use function::function;
