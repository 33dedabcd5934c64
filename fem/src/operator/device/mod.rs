//! Element equations on a device. The source of the kernels is recorded from the processor's code.

mod equations;
mod equations_source;
mod product;
mod product_source;
mod slots;

pub(super) use equations::DeviceEquations;
pub use equations_source::equations_kernels;
pub use product::device_product;
pub use product_source::product_kernels;
