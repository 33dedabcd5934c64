//! The processor: elements side by side in registers, chunks of them on threads.

mod apply;
mod assembly;
mod chunk;
mod gather;
mod lanes;
mod matrix_free;
mod regions;
mod shifts;
mod stresses;

pub(crate) use assembly::Assembly;
#[cfg(test)]
pub(crate) use gather::{Buffers, Gather};
#[cfg(test)]
pub(crate) use lanes::dispatch;
#[cfg(test)]
pub(crate) use matrix_free::MatrixFree;
pub(crate) use matrix_free::product;
