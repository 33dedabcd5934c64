//! Where kernels run: a device with memory of its own, and what it is asked.
//!
//! A kernel is a function of C that computes one item of many; the same source is compiled by the driver of a
//! graphics card (`Cuda`, feature `cuda`) and by the C compiler of this machine (`Host`), so that all
//! but the driver is tested where there is no card. Items do not see each other, and no sum
//! depends on their order: a device gives the same bits each time.

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
