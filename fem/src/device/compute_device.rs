//! The device of a run, chosen by its user.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

#[cfg(feature = "cuda")]
use super::cuda::Cuda;
use super::host::Host;
use super::kernel::{Kernel, source};
use super::machine::{Device, DeviceError, Memory, Program};

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

    pub fn with(device: impl Device + 'static) -> Self {
        Self { device: Arc::new(device), programs: Arc::default() }
    }

    /// What it calls itself.
    pub fn name(&self) -> String {
        self.device.name()
    }

    /// So many bytes of memory, all zero.
    pub fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError> {
        self.device.allocate(bytes)
    }

    /// Kernels, which are compiled once.
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
