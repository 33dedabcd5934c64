//! The discrete equations on a mesh: element kernels, memory layout, and the unknowns.
//!
//! The folders in the order of their layers; a file imports from its own folder and from lower layers only:
//!
//! - `kernel`: residual, linearisation and contraction with the tangent of one element, for any number type; it calls
//!   the point law of the module `material`.
//! - files of this folder: the traits [`Operator`] and [`Product`] that solvers use, the layout of the elements in
//!   batches and chunks, the assembled tangent.
//! - `cpu`: the kernel on SIMD registers, and the matrix-free product.
//! - `device`: the kernel recorded as C source, and its execution on a device.
//! - `assembly`: the operator of a mesh.

mod assembly;
mod bounds;
mod cell_stress;
mod cpu;
mod deterministic_reduce;
mod device;
mod equations;
mod graph;
mod increment;
mod kernel;
mod layout;
mod pattern;
mod sensitivity;
mod unknowns;

pub use assembly::{Assembly, linear, quadratic};
pub use bounds::Bounds;
pub use cell_stress::CellStress;
#[cfg(test)]
pub(crate) use cpu::dispatch;
pub use cpu::{Buffers, ElementLaw, Gather, SINGLE_FROM, product, state_len};
pub use device::{device_product, equations_kernels, product_kernels};
pub use equations::{AppliedOnDevice, Coupling, EquationsOnDevice, Operator, Product};
pub use graph::Graph;
pub use increment::{Increment, NodeBlock, PairBlock, Residual, StepContext, add_pair_products};
pub use kernel::{
    Blocks, Constants, DataLayout, ElementResidual, ElementState, MOST_POINTS, linearise, residual,
    write_blocks,
};
pub use layout::{LANES, Layout};
pub use pattern::{Pattern, Tangent};
pub use sensitivity::{Shift, jacobian_product, residual_rate, state_rate};
pub use unknowns::{NONE, Unknowns};
