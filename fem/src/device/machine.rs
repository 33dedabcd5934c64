//! Interface of a device that runs kernels.

use std::any::Any;
use std::fmt;

use super::kernel::Kernel;

/// Error message of a device.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);

/// Device with its own memory that runs kernels in the order in which they are launched.
pub trait Device: fmt::Debug + Send + Sync {
    /// Returns the name of the device.
    fn name(&self) -> String;

    /// Compiles the source of kernels. Each kernel is launched by its index in `kernels`.
    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError>;

    /// Allocates `bytes` bytes of memory, all zero.
    fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError>;
}

/// Memory of a device. Dropping the value frees the memory.
pub trait Memory: Any + fmt::Debug + Send {
    /// Copies `bytes` to the device, starting at byte `at`.
    fn write(&mut self, at: usize, bytes: &[u8]) -> Result<(), DeviceError>;

    /// Copies the first `bytes.len()` bytes of the memory to `bytes`, after all earlier launches have finished.
    fn read(&self, bytes: &mut [u8]) -> Result<(), DeviceError>;
}

/// Compiled kernels.
pub trait Program: fmt::Debug + Send + Sync {
    /// Runs a kernel for the items 0 to `items − 1`.
    fn launch(
        &self,
        kernel: usize,
        items: usize,
        arguments: &[Argument],
    ) -> Result<(), DeviceError>;
}

/// Argument of a kernel. The variant must match the C type of the kernel's parameter.
#[derive(Clone, Copy, Debug)]
pub enum Argument<'a> {
    /// Argument for a parameter that is a pointer to device memory.
    Memory(&'a dyn Memory),
    /// Argument for a parameter of type `index`.
    Index(u64),
    /// Argument for a parameter of type `double`.
    Real(f64),
}
