//! Devices that run kernels in their own memory, and their interface.
//!
//! A kernel is a C function that processes one of many independent items. The same source is compiled by the driver
//! of a GPU (`Cuda`, feature `cuda`) and by the C compiler of this machine (`Host`), so that everything except the
//! driver can be tested without a GPU. No sum depends on the order in which the items are processed: repeated runs on
//! a device give bitwise equal results.

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
