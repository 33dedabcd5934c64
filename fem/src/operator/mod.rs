//! The discrete equations on a mesh: element kernels, memory layout, and the unknowns.
//!
//! *Physics* is the element kernel (`element.rs`), which calls the point kernel of the module `material`.
//! Residual, linearisation and the product with the tangent (`backend/apply.rs`) implement the same
//! equations. *Geometry* is [`Domain`](crate::element::Domain). *Layout* ([`Layout`]) groups the elements
//! into SIMD lanes and chunks. Solvers use the traits [`Operator`] and [`Product`], which a `backend`
//! implements for the processor or a device.

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
mod unknowns;

#[cfg(test)]
pub(crate) use backend::dispatch;
pub use backend::{Assembly, SINGLE_FROM, device_product, linear, product, quadratic};
pub use backend::{Buffers, Gather, equations_kernels, product_kernels};
pub use blocks::{Blocks, write_blocks};
pub use bounds::Bounds;
pub use cell_stress::CellStress;
pub use element::{Constants, ElementState, MOST_POINTS};
pub use equations::EquationsOnDevice;
pub use equations::{AppliedOnDevice, Coupling, Operator, Product};
pub use graph::Graph;
pub use layout::LANES;
pub use layout::Layout;
pub use pattern::{Pattern, Tangent};
pub use point_data::PointData;
pub use residual::{Increment, NodeBlock, Residual, Shift, StepContext};
pub use unknowns::{NONE, Unknowns};
