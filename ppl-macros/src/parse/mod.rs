//! From tokens to what was written. What cannot be read becomes a broken statement, or a model
//! without statements, and reading goes on behind it.

mod attributes;
mod ending;
mod signature;
mod statements;

pub(crate) use signature::models;
