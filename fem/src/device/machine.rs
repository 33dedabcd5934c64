//! A machine that runs kernels, and what it is asked.

use std::any::Any;
use std::fmt;

use super::kernel::Kernel;

/// What went wrong on a device, in words.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);

/// A machine with memory of its own that runs kernels in the order in which they are launched.
pub trait Device: fmt::Debug + Send + Sync {
    /// What it calls itself.
    fn name(&self) -> String;

    /// Compiles the source of kernels, which are launched by their place in the list.
    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError>;

    /// So many bytes of memory, all zero.
    fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError>;
}

/// Memory of a device, given back when it is dropped.
pub trait Memory: Any + fmt::Debug + Send {
    /// Copies bytes to a place.
    fn write(&mut self, at: usize, bytes: &[u8]) -> Result<(), DeviceError>;

    /// Copies the first bytes back, after all that was launched before.
    fn read(&self, bytes: &mut [u8]) -> Result<(), DeviceError>;
}

/// Compiled kernels.
pub trait Program: fmt::Debug + Send + Sync {
    /// Runs a kernel for so many items.
    fn launch(
        &self,
        kernel: usize,
        items: usize,
        arguments: &[Argument],
    ) -> Result<(), DeviceError>;
}

/// What a kernel is given; each has the type of its parameter.
#[derive(Clone, Copy, Debug)]
pub enum Argument<'a> {
    /// A pointer.
    Memory(&'a dyn Memory),
    /// `index`.
    Index(u64),
    /// `double`.
    Real(f64),
}
