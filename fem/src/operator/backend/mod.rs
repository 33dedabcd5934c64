//! Implementations of the equations: on the processor, with several elements per SIMD register and chunks of
//! elements on threads; and on devices, whose kernels are generated from the code of the processor.

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
mod regions;
mod shifts;
mod slots;
mod stresses;

pub use assembly::{Assembly, linear, quadratic};
pub use device_product::device_product;
pub use equations_source::equations_kernels;
pub use gather::{Buffers, Gather};
#[cfg(test)]
pub(crate) use lanes::dispatch;
pub use matrix_free::{SINGLE_FROM, product};
pub use product_source::product_kernels;
