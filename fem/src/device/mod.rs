//! Where kernels run: a device with memory of its own, and what it is asked.
//!
//! A kernel is a function of C that computes one item of many; the same source is compiled by the driver of a
//! graphics card ([`Cuda`], feature `cuda`) and by the C compiler of this machine ([`Host`]), so that all
//! but the driver is tested where there is no card. Items do not see each other, and no sum
//! depends on their order: a device gives the same bits each time.

#[cfg(feature = "cuda")]
mod cuda;
mod host;
mod kernel;

use std::any::Any;
use std::collections::HashMap;
use std::fmt;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};

#[cfg(feature = "cuda")]
use cuda::Cuda;
use host::Host;
pub(crate) use kernel::{Kernel, source};

/// What went wrong on a device, in words.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub(crate) String);

/// Where the linear systems of a run are solved, in place of the processor.
///
/// Runs may share one. Compiled kernels are kept.
#[derive(Clone, Debug)]
pub struct ComputeDevice {
    device: Arc<dyn Device>,
    programs: Arc<Mutex<HashMap<String, Arc<dyn Program>>>>,
}

impl ComputeDevice {
    /// The first NVIDIA card of this machine.
    ///
    /// # Errors
    /// [`DeviceError`] if the program was built without the feature `cuda`, or if there is no card, driver or
    /// compiler of kernels (NVRTC).
    pub fn cuda() -> Result<Self, DeviceError> {
        #[cfg(feature = "cuda")]
        return Cuda::new().map(Self::with);
        #[cfg(not(feature = "cuda"))]
        Err(DeviceError(
            "this program was built without CUDA: build it with --features cuda".into(),
        ))
    }

    /// This machine in the place of a card: the same kernels by its C compiler. It serves to test.
    ///
    /// # Errors
    /// [`DeviceError`] if there is no C compiler.
    pub fn host() -> Result<Self, DeviceError> {
        Host::new().map(Self::with)
    }

    fn with(device: impl Device + 'static) -> Self {
        Self { device: Arc::new(device), programs: Arc::default() }
    }

    /// What it calls itself.
    pub fn name(&self) -> String {
        self.device.name()
    }

    /// Kernels, which are compiled once.
    pub(crate) fn compile(&self, kernels: &[Kernel]) -> Result<Arc<dyn Program>, DeviceError> {
        let text = source(kernels);
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(program) = programs.get(&text) {
            return Ok(Arc::clone(program));
        }
        let program: Arc<dyn Program> = self.device.compile(&text, kernels)?.into();
        programs.insert(text, Arc::clone(&program));
        Ok(program)
    }
}

/// A machine with memory of its own that runs kernels in the order in which they are launched.
pub(crate) trait Device: fmt::Debug + Send + Sync {
    /// What it calls itself.
    fn name(&self) -> String;

    /// Compiles the source of kernels, which are launched by their place in the list.
    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError>;

    /// So many bytes of memory, all zero.
    fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError>;
}

/// Memory of a device, given back when it is dropped.
pub(crate) trait Memory: Any + fmt::Debug + Send {
    /// Copies bytes to a place.
    fn write(&mut self, at: usize, bytes: &[u8]) -> Result<(), DeviceError>;

    /// Copies the first bytes back, after all that was launched before.
    fn read(&self, bytes: &mut [u8]) -> Result<(), DeviceError>;
}

/// Compiled kernels.
pub(crate) trait Program: fmt::Debug + Send + Sync {
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
pub(crate) enum Argument<'a> {
    /// A pointer.
    Memory(&'a dyn Memory),
    /// `index`.
    Index(u64),
    /// `double`.
    Real(f64),
}

/// Numbers in the memory of a device.
pub(crate) struct Array<T> {
    memory: Box<dyn Memory>,
    len: usize,
    numbers: PhantomData<T>,
}

impl<T> fmt::Debug for Array<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Array").field("len", &self.len).finish_non_exhaustive()
    }
}

impl<T: Pod + Zeroable> Array<T> {
    pub(crate) fn zeros(device: &ComputeDevice, len: usize) -> Result<Self, DeviceError> {
        // no device gives out nothing
        let memory = device.device.allocate(len.max(1) * size_of::<T>())?;
        Ok(Self { memory, len, numbers: PhantomData })
    }

    /// An array that nobody can use.
    pub(crate) fn lost(len: usize) -> Self {
        Self { memory: Box::new(Lost), len, numbers: PhantomData }
    }

    pub(crate) fn of(device: &ComputeDevice, numbers: &[T]) -> Result<Self, DeviceError> {
        let mut array = Self::zeros(device, numbers.len())?;
        array.write(0, numbers)?;
        Ok(array)
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Copies numbers to a place.
    pub(crate) fn write(&mut self, at: usize, numbers: &[T]) -> Result<(), DeviceError> {
        assert!(at + numbers.len() <= self.len, "the numbers fit into the array");
        if numbers.is_empty() {
            return Ok(());
        }
        self.memory.write(at * size_of::<T>(), bytemuck::cast_slice(numbers))
    }

    /// Copies the first numbers back.
    pub(crate) fn read(&self, numbers: &mut [T]) -> Result<(), DeviceError> {
        assert!(numbers.len() <= self.len, "as many numbers as the array has");
        if numbers.is_empty() {
            return Ok(());
        }
        self.memory.read(bytemuck::cast_slice_mut(numbers))
    }

    pub(crate) fn argument(&self) -> Argument<'_> {
        Argument::Memory(self.memory.as_ref())
    }
}

/// What stands for memory that was not to be had.
#[derive(Debug)]
struct Lost;

impl Memory for Lost {
    fn write(&mut self, _: usize, _: &[u8]) -> Result<(), DeviceError> {
        Err(DeviceError("the memory was not to be had".into()))
    }

    fn read(&self, _: &mut [u8]) -> Result<(), DeviceError> {
        Err(DeviceError("the memory was not to be had".into()))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/device.rs"]
pub(crate) mod tests;
