//! From what was written and what is known of it to Rust that a person can follow.
//!
//! Names of the macro's own have mixed-site spans: variables of a user called `cx` are others.
//! Tokens of the user are handed on as they are.

mod function;
mod statements;

pub(crate) use function::function;
