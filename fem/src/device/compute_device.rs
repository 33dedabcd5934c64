//! Device that the user selects for the linear systems of a run.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

#[cfg(feature = "cuda")]
use super::cuda::Cuda;
use super::host::Host;
use super::kernel::{Kernel, source};
use super::machine::{Device, DeviceError, Memory, Program};

/// Device that solves the linear systems of a run instead of the processor.
///
/// Several runs can share a device. Compiled kernels are cached.
#[derive(Clone, Debug)]
pub struct ComputeDevice {
    device: Arc<dyn Device>,
    programs: Arc<Mutex<HashMap<String, Arc<dyn Program>>>>,
}

impl ComputeDevice {
    /// Opens the first NVIDIA GPU of this machine.
    ///
    /// # Errors
    /// [`DeviceError`] if the program was built without the feature `cuda`, or if there is no GPU, driver or kernel
    /// compiler (NVRTC).
    pub fn cuda() -> Result<Self, DeviceError> {
        #[cfg(feature = "cuda")]
        return Cuda::new().map(Self::with);
        #[cfg(not(feature = "cuda"))]
        Err(DeviceError(
            "this program was built without CUDA: build it with --features cuda".into(),
        ))
    }

    /// Uses the processor as a device, for tests. The C compiler compiles the same kernels as for a GPU.
    ///
    /// # Errors
    /// [`DeviceError`] if there is no C compiler.
    pub fn host() -> Result<Self, DeviceError> {
        Host::new().map(Self::with)
    }

    /// Creates a compute device from an implementation of [`Device`].
    pub fn with(device: impl Device + 'static) -> Self {
        Self { device: Arc::new(device), programs: Arc::default() }
    }

    /// Returns the name of the device.
    pub fn name(&self) -> String {
        self.device.name()
    }

    /// Allocates `bytes` bytes of memory, all zero.
    pub fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError> {
        self.device.allocate(bytes)
    }

    /// Compiles kernels, or returns them from the cache.
    pub fn compile(&self, kernels: &[Kernel]) -> Result<Arc<dyn Program>, DeviceError> {
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
