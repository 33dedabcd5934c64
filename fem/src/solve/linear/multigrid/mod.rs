//! Multigrid preconditioner: the hierarchy, which the processor creates, and its smoothers and cycles, which run in the
//! memory of this process or of a device.
//!
//! Linear elements use the assembled tangent, with separate preconditioners for displacement and damage. Quadratic
//! elements use the matrix-free tangent; the assembled tangent of the linear shape functions is the next coarser level.

mod aggregation;
mod amg;
mod assembled;
mod block_csr;
mod chebyshev;
mod coarse_nodes;
mod cycle;
mod element_tangent;
mod field_split;
mod matrix;
mod rows;

pub(crate) use amg::{Aggregation, AmgInMemory};
pub(crate) use assembled::Assembled;
pub(crate) use block_csr::BlockCsr;
pub(crate) use chebyshev::{Smoother, Smoothing};
pub(crate) use cycle::{Amg, AmgLevel, FreeTangent, Level, MatrixFree, Multigrid};
pub(crate) use element_tangent::{DEGREE, ElementTangent, midpoints_of_vertices};
pub(crate) use field_split::{Block, FieldSplit, FieldSplitInMemory, Fields};
pub(crate) use matrix::{Grid, Matrix, NodalPreconditioner, Preconditioner, Relaxation};
