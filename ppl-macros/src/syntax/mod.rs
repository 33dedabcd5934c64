//! Properties of Rust syntax, independent of any model.

pub(crate) mod expressions;
pub(crate) mod patterns;
pub(crate) mod places;
pub(crate) mod statements;
pub(crate) mod tokens;
