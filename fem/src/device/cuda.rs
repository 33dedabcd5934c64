//! NVIDIA GPUs. The driver and the kernel compiler (NVRTC) are loaded at run time.
#![expect(unsafe_code, reason = "C functions check for the driver and launch kernels")]

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

/// Number of threads per block. The kernel of quadratic elements uses the largest possible number of registers per
/// thread, which limits the number of threads.
const THREADS: u32 = 128;

fn failed(what: &str) -> impl Fn(&dyn Display) -> DeviceError {
    move |error| DeviceError(format!("CUDA: {what}: {error}"))
}

impl Cuda {
    /// Opens the first GPU of this machine.
    pub(super) fn new() -> Result<Self, DeviceError> {
        // SAFETY: both functions only check whether a library can be loaded. Without these checks the calls below
        // panic if a library is missing.
        let (driver, compiler) = unsafe {
            (cudarc::driver::sys::is_culib_present(), cudarc::nvrtc::sys::is_culib_present())
        };
        if !driver {
            return Err(DeviceError(
                "CUDA: the NVIDIA driver (libcuda) is not installed: install it, or use device \"auto\"".into(),
            ));
        }
        if !compiler {
            return Err(DeviceError(
                "CUDA: the kernel compiler (libnvrtc) is not installed: install the CUDA toolkit, or add the \
                 library's folder to LD_LIBRARY_PATH"
                    .into(),
            ));
        }
        let context = CudaContext::new(0).map_err(|e| failed("the GPU cannot be opened")(&e))?;
        let stream = context.default_stream();
        Ok(Self { context, stream })
    }
}

impl Device for Cuda {
    fn name(&self) -> String {
        self.context.name().unwrap_or_else(|_| "GPU without a name".into())
    }

    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError> {
        let failed = failed("the kernels cannot be compiled");
        let (major, minor) = self.context.compute_capability().map_err(|e| failed(&e))?;
        // as on the processor, no fused multiply-add unless the source calls `fma`
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
            failed(&format!("{} MB of GPU memory cannot be allocated", bytes >> 20))(&e)
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
        self.stream
            .memcpy_htod(bytes, &mut part)
            .map_err(|e| failed("copying to the GPU failed")(&e))
    }

    fn read(&self, bytes: &mut [u8]) -> Result<(), DeviceError> {
        let failed = failed("copying from the GPU failed");
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
        let blocks = u32::try_from(blocks).map_err(|_| {
            DeviceError(format!("CUDA: {items} items exceed the limit of one kernel launch"))
        })?;
        let count = items as u64;
        let mut launch = self.stream.launch_builder(&self.functions[kernel]);
        launch.arg(&count);
        for argument in arguments {
            match argument {
                Argument::Memory(memory) => {
                    let memory: &dyn Any = *memory;
                    let Some(bytes) = memory.downcast_ref::<Bytes>() else {
                        return Err(DeviceError(
                            "a kernel argument is memory of another device".into(),
                        ));
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
        unsafe { launch.launch(form) }.map(|_| ()).map_err(|e| failed("a kernel launch failed")(&e))
    }
}
