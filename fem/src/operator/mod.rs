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
mod unknowns;

pub use backend::{Assembly, device_product, product};
pub use backend::{Buffers, Gather, MatrixFree, dispatch, equations_kernels, product_kernels};
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
