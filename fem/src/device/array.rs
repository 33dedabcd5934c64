//! Array of numbers in the memory of a device.

use std::fmt;
use std::marker::PhantomData;

use bytemuck::{Pod, Zeroable};

use super::compute_device::ComputeDevice;
use super::machine::{Argument, DeviceError, Memory};

/// Array of numbers in the memory of a device.
pub struct Array<T> {
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
    /// Creates an array of `len` zeros.
    pub fn zeros(device: &ComputeDevice, len: usize) -> Result<Self, DeviceError> {
        // devices cannot allocate zero bytes
        let memory = device.allocate(len.max(1) * size_of::<T>())?;
        Ok(Self { memory, len, numbers: PhantomData })
    }

    /// Creates a placeholder for an array whose memory could not be allocated. Every transfer to or from the
    /// placeholder fails.
    pub fn lost(len: usize) -> Self {
        Self { memory: Box::new(Lost), len, numbers: PhantomData }
    }

    /// Creates an array with a copy of `numbers`.
    pub fn of(device: &ComputeDevice, numbers: &[T]) -> Result<Self, DeviceError> {
        let mut array = Self::zeros(device, numbers.len())?;
        array.write(0, numbers)?;
        Ok(array)
    }

    /// Returns the number of elements.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Copies `numbers` to the device, starting at index `at`.
    pub fn write(&mut self, at: usize, numbers: &[T]) -> Result<(), DeviceError> {
        assert!(at + numbers.len() <= self.len, "the values do not fit into the array");
        if numbers.is_empty() {
            return Ok(());
        }
        self.memory.write(at * size_of::<T>(), bytemuck::cast_slice(numbers))
    }

    /// Copies the first `numbers.len()` elements of the array to `numbers`.
    pub fn read(&self, numbers: &mut [T]) -> Result<(), DeviceError> {
        assert!(numbers.len() <= self.len, "the array has fewer elements than are read");
        if numbers.is_empty() {
            return Ok(());
        }
        self.memory.read(bytemuck::cast_slice_mut(numbers))
    }

    /// Returns the array as an argument of a kernel.
    pub fn argument(&self) -> Argument<'_> {
        Argument::Memory(self.memory.as_ref())
    }
}

/// Placeholder for device memory that could not be allocated.
#[derive(Debug)]
struct Lost;

impl Memory for Lost {
    fn write(&mut self, _: usize, _: &[u8]) -> Result<(), DeviceError> {
        Err(DeviceError("device memory could not be allocated earlier in this run".into()))
    }

    fn read(&self, _: &mut [u8]) -> Result<(), DeviceError> {
        Err(DeviceError("device memory could not be allocated earlier in this run".into()))
    }
}
