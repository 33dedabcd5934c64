//! The equations on a mesh: physics, geometry and layout, and the unknowns that they act on.
//!
//! *Physics* is the element kernel (`element.rs`) over the point kernel of the room of materials:
//! residual, linearisation and, in `backend/apply.rs`, the product read the same equations.
//! *Geometry* is [`Domain`](crate::element::Domain). *Layout* ([`Layout`]) is where elements stand in
//! lanes and chunks. Solvers see [`Operator`] and [`Product`]; a machine implements them in a
//! `backend`.

mod backend;
mod blocks;
mod bounds;
mod cell_stress;
mod deterministic_reduce;
mod element;
mod equations;
mod graph;
mod layout;
mod pattern;
mod point_data;
mod rates;
mod residual;
#[cfg(test)]
#[path = "../../tests/unit/operator.rs"]
mod tests;
mod unknowns;

pub(crate) use backend::{Assembly, device_product, product};
#[cfg(test)]
pub(crate) use backend::{MatrixFree, dispatch};
pub(crate) use bounds::Bounds;
pub(crate) use cell_stress::CellStress;
#[cfg(test)]
pub(crate) use equations::EquationsOnDevice;
pub(crate) use equations::{AppliedOnDevice, Coupling, Operator, Product};
pub(crate) use graph::Graph;
#[cfg(test)]
pub(crate) use layout::LANES;
pub(crate) use layout::Layout;
pub(crate) use pattern::{Pattern, Tangent};
pub(crate) use residual::{Increment, NodeBlock, Residual, Shift, StepContext};
pub(crate) use unknowns::{NONE, Unknowns};
