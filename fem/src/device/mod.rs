//! Devices that run kernels in their own memory, and their interface.
//!
//! A kernel is a C function that computes one of many items. The same source is compiled by the driver of a GPU
//! (`Cuda`, feature `cuda`) and by the C compiler of this machine (`Host`), so that everything except the driver can
//! be tested without a GPU. Items are independent, and no sum depends on their order: a device gives bitwise the same
//! result each time.

mod array;
mod compute_device;
#[cfg(feature = "cuda")]
mod cuda;
mod host;
mod kernel;
mod machine;

pub use array::Array;
pub use compute_device::ComputeDevice;
pub use host::Host;
pub use kernel::{Kernel, source};
pub use machine::{Argument, Device, DeviceError, Memory, Program};
