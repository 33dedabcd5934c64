//! The processor: elements side by side in registers, chunks of them on threads; and devices, whose kernels
//! are recorded from those of the processor.

mod apply;
mod assembly;
mod chunk;
mod device_equations;
mod device_product;
mod equations_source;
mod gather;
mod kinds;
mod lanes;
mod matrix_free;
mod product_source;
mod recording;
mod regions;
mod shifts;
mod slots;
mod stresses;

pub(crate) use assembly::Assembly;
pub(crate) use device_product::device_product;
#[cfg(test)]
pub(crate) use equations_source::equations_kernels;
#[cfg(test)]
pub(crate) use gather::{Buffers, Gather};
#[cfg(test)]
pub(crate) use lanes::dispatch;
#[cfg(test)]
pub(crate) use matrix_free::MatrixFree;
pub(crate) use matrix_free::product;
#[cfg(test)]
pub(crate) use product_source::product_kernels;
