//! The equations on a mesh: residual, consistent tangent, and the unknowns that they act on.

mod assembly;
mod element;
mod graph;
mod pattern;
mod residual;
#[cfg(test)]
mod tests;
mod unknowns;

pub(crate) use assembly::{Assembly, Coupling, Operator};
pub(crate) use graph::Graph;
pub(crate) use pattern::{Pattern, Tangent};
pub(crate) use residual::{Increment, NodeBlock, Residual, Span};
pub(crate) use unknowns::{NONE, Unknowns};
