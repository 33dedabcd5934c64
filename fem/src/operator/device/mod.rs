//! The element equations on a device, whose kernels are recorded from the code of the processor.

mod equations;
mod equations_source;
mod product;
mod product_source;
mod slots;

pub(super) use equations::DeviceEquations;
pub use equations_source::equations_kernels;
pub use product::device_product;
pub use product_source::product_kernels;
