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
    element_type: PhantomData<T>,
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
        Ok(Self { memory, len, element_type: PhantomData })
    }

    /// Creates a placeholder for an array whose memory could not be allocated. Every transfer to or from the
    /// placeholder fails.
    pub fn lost(len: usize) -> Self {
        Self { memory: Box::new(Lost), len, element_type: PhantomData }
    }

    /// Creates an array with a copy of `values`.
    pub fn of(device: &ComputeDevice, values: &[T]) -> Result<Self, DeviceError> {
        let mut array = Self::zeros(device, values.len())?;
        array.write(0, values)?;
        Ok(array)
    }

    /// Returns the number of elements.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Copies `values` to the device, starting at index `at`.
    pub fn write(&mut self, at: usize, values: &[T]) -> Result<(), DeviceError> {
        assert!(at + values.len() <= self.len, "the values do not fit into the array");
        if values.is_empty() {
            return Ok(());
        }
        self.memory.write(at * size_of::<T>(), bytemuck::cast_slice(values))
    }

    /// Copies the first `values.len()` elements of the array to `values`.
    pub fn read(&self, values: &mut [T]) -> Result<(), DeviceError> {
        assert!(values.len() <= self.len, "the array has fewer elements than are read");
        if values.is_empty() {
            return Ok(());
        }
        self.memory.read(bytemuck::cast_slice_mut(values))
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
