//! Questions about Rust as it was written, answered without knowing any model.

pub(crate) mod expressions;
pub(crate) mod patterns;
pub(crate) mod places;
pub(crate) mod statements;
pub(crate) mod tokens;
