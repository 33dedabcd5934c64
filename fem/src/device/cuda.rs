//! NVIDIA GPUs. The driver and its compiler are loaded at run time.
#![expect(
    unsafe_code,
    reason = "whether a driver is there is asked of, and kernels are launched by, C functions"
)]

use std::any::Any;
use std::fmt::Display;
use std::sync::Arc;

use cudarc::driver::{
    CudaContext, CudaFunction, CudaSlice, CudaStream, LaunchConfig, PushKernelArg,
};
use cudarc::nvrtc::{CompileOptions, compile_ptx_with_opts};

use super::kernel::Kernel;
use super::machine::{Argument, Device, DeviceError, Memory, Program};

/// The first GPU of this machine.
#[derive(Debug)]
pub(super) struct Cuda {
    context: Arc<CudaContext>,
    stream: Arc<CudaStream>,
}

/// Threads per block. The kernel of quadratic elements needs the largest number of registers that a thread can have.
const THREADS: u32 = 128;

fn failed(what: &str) -> impl Fn(&dyn Display) -> DeviceError {
    move |error| DeviceError(format!("CUDA: {what}: {error}"))
}

impl Cuda {
    /// Opens the first GPU of this machine.
    pub(super) fn new() -> Result<Self, DeviceError> {
        // SAFETY: both functions only check whether a library can be loaded; without this check the calls below
        // panic.
        let (driver, compiler) = unsafe {
            (cudarc::driver::sys::is_culib_present(), cudarc::nvrtc::sys::is_culib_present())
        };
        if !driver {
            return Err(DeviceError(
                "CUDA: no driver is installed (libcuda): install it, or leave the device to \"auto\"".into(),
            ));
        }
        if !compiler {
            return Err(DeviceError(
                "CUDA: the driver is there, its compiler (libnvrtc) is not: install the CUDA toolkit, or put \
                 the library's folder into LD_LIBRARY_PATH"
                    .into(),
            ));
        }
        let context = CudaContext::new(0).map_err(|e| failed("no card")(&e))?;
        let stream = context.default_stream();
        Ok(Self { context, stream })
    }
}

impl Device for Cuda {
    fn name(&self) -> String {
        self.context.name().unwrap_or_else(|_| "a card without a name".into())
    }

    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError> {
        let failed = failed("kernels");
        let (major, minor) = self.context.compute_capability().map_err(|e| failed(&e))?;
        // products and sums are fused only where the source requests it, as on the processor
        let options =
            ["--fmad=false".to_string(), format!("--gpu-architecture=compute_{major}{minor}")];
        let options = CompileOptions { options: options.to_vec(), ..CompileOptions::default() };
        let ptx = compile_ptx_with_opts(text, options).map_err(|e| failed(&e))?;
        let module = self.context.load_module(ptx).map_err(|e| failed(&e))?;
        let functions: Result<Vec<CudaFunction>, _> =
            kernels.iter().map(|kernel| module.load_function(&kernel.name)).collect();
        let functions = functions.map_err(|e| failed(&e))?;
        Ok(Box::new(Functions { functions, stream: Arc::clone(&self.stream) }))
    }

    fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError> {
        let memory = self.stream.alloc_zeros::<u8>(bytes).map_err(|e| {
            failed(&format!("{} MB of the card's memory are not to be had", bytes >> 20))(&e)
        })?;
        Ok(Box::new(Bytes { memory, stream: Arc::clone(&self.stream) }))
    }
}

#[derive(Debug)]
struct Bytes {
    memory: CudaSlice<u8>,
    stream: Arc<CudaStream>,
}

impl Memory for Bytes {
    fn write(&mut self, at: usize, bytes: &[u8]) -> Result<(), DeviceError> {
        let mut part = self.memory.slice_mut(at..at + bytes.len());
        self.stream.memcpy_htod(bytes, &mut part).map_err(|e| failed("a copy to the card")(&e))
    }

    fn read(&self, bytes: &mut [u8]) -> Result<(), DeviceError> {
        let failed = failed("a copy from the card");
        let part = self.memory.slice(..bytes.len());
        self.stream.memcpy_dtoh(&part, bytes).map_err(|e| failed(&e))?;
        self.stream.synchronize().map_err(|e| failed(&e))
    }
}

#[derive(Debug)]
struct Functions {
    functions: Vec<CudaFunction>,
    stream: Arc<CudaStream>,
}

impl Program for Functions {
    fn launch(
        &self,
        kernel: usize,
        items: usize,
        arguments: &[Argument],
    ) -> Result<(), DeviceError> {
        let blocks = items.div_ceil(THREADS as usize);
        if blocks == 0 {
            return Ok(());
        }
        let blocks = u32::try_from(blocks)
            .map_err(|_| DeviceError(format!("CUDA: {items} items are too many for one launch")))?;
        let count = items as u64;
        let mut launch = self.stream.launch_builder(&self.functions[kernel]);
        launch.arg(&count);
        for argument in arguments {
            match argument {
                Argument::Memory(memory) => {
                    let memory: &dyn Any = *memory;
                    let Some(bytes) = memory.downcast_ref::<Bytes>() else {
                        return Err(DeviceError("memory of another device".into()));
                    };
                    launch.arg(&bytes.memory);
                }
                Argument::Index(number) => {
                    launch.arg(number);
                }
                Argument::Real(number) => {
                    launch.arg(number);
                }
            }
        }
        let form = LaunchConfig {
            grid_dim: (blocks, 1, 1),
            block_dim: (THREADS, 1, 1),
            shared_mem_bytes: 0,
        };
        // SAFETY: the caller must pass the arguments that the kernel declares, and arrays that are long enough for
        // this number of items.
        unsafe { launch.launch(form) }.map(|_| ()).map_err(|e| failed("a launch")(&e))
    }
}
