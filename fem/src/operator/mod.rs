//! The equations on a mesh: residual, consistent tangent, and the unknowns that they act on.

mod assembly;
mod batched;
mod batches;
mod bounds;
mod element;
mod graph;
mod in_order;
mod kernel;
mod lanes;
mod matrix_free;
mod pattern;
mod product;
mod reduced;
mod residual;
#[cfg(test)]
mod tests;
mod unknowns;

pub(crate) use assembly::{Assembly, Coupling, Operator};
pub(crate) use bounds::Bounds;
pub(crate) use graph::Graph;
#[cfg(test)]
pub(crate) use lanes::{LANES, dispatch};
pub(crate) use matrix_free::{Layout, MatrixFree};
pub(crate) use pattern::{Pattern, Tangent};
#[cfg(test)]
pub(crate) use reduced::ReferenceRule;
pub(crate) use residual::{Increment, NodeBlock, Residual, Span};
pub(crate) use unknowns::{NONE, Unknowns};
