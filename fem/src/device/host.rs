//! The processor as a device: the C compiler compiles the kernels, and threads process the items.
#![expect(unsafe_code, reason = "kernels are functions of a library that is loaded at run time")]

use std::any::Any;
use std::cell::UnsafeCell;
use std::ffi::c_void;
use std::process::Command;

use libloading::Library;
use rayon::prelude::*;

use super::kernel::Kernel;
use super::machine::{Argument, Device, DeviceError, Memory, Program};

/// The processor as a device, with the C compiler that compiles the kernels.
#[derive(Debug)]
pub struct Host {
    compiler: String,
}

/// Number of items that one task of a launch processes.
const ITEMS: usize = 4096;

impl Host {
    /// Creates the device with the compiler that the environment variable `CC` names; without this variable, with `cc`.
    pub fn new() -> Result<Self, DeviceError> {
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
        match Command::new(&compiler).arg("--version").output() {
            Ok(output) if output.status.success() => Ok(Self { compiler }),
            Ok(output) => Err(DeviceError(format!(
                "the C compiler {compiler} does not run ({}): name another compiler in the variable CC",
                output.status
            ))),
            Err(error) => Err(DeviceError(format!(
                "the C compiler {compiler} does not run ({error}): install a compiler, or name it in the variable CC"
            ))),
        }
    }

    fn compile_library(&self, text: &str) -> Result<Library, DeviceError> {
        let failed = |what: &str, error: &dyn std::fmt::Display| {
            DeviceError(format!("kernels for the host: {what}: {error}"))
        };
        let folder =
            tempfile::tempdir().map_err(|e| failed("a temporary folder cannot be created", &e))?;
        let (code, library) = (folder.path().join("kernels.c"), folder.path().join("kernels.so"));
        std::fs::write(&code, text).map_err(|e| failed("the source cannot be written", &e))?;
        // no fused multiply-add unless the source calls `fma`: results then equal the results of the processor's own
        // code
        let common = ["-std=c11", "-O2", "-ffp-contract=off", "-fPIC", "-shared"];
        let compile = |native: &[&str]| {
            let mut command = Command::new(&self.compiler);
            command.args(common).args(native).arg(&code).arg("-o").arg(&library).arg("-lm");
            command.output().map_err(|e| failed(&self.compiler, &e))
        };
        let mut output = compile(&["-march=native"])?;
        if !output.status.success() {
            // compile without -march=native, which the compiler may not support on this machine
            output = compile(&[])?;
        }
        if !output.status.success() {
            let message = String::from_utf8_lossy(&output.stderr);
            return Err(failed(
                &self.compiler,
                &message.lines().take(5).collect::<Vec<_>>().join(" "),
            ));
        }
        // SAFETY: the library was compiled above from kernels only, so that loading it executes no code.
        unsafe { Library::new(&library) }.map_err(|e| failed("the library cannot be loaded", &e))
    }
}

impl Device for Host {
    fn name(&self) -> String {
        format!("this machine by {}", self.compiler)
    }

    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError> {
        let library = self.compile_library(text)?;
        let entries: Result<Vec<Entry>, _> = kernels
            .iter()
            .map(|kernel| {
                // SAFETY: the source contains a function of this type for each kernel.
                unsafe { library.get::<Entry>(kernel.name.as_bytes()) }
                    .map(|symbol| *symbol)
                    .map_err(|e| DeviceError(format!("kernel {}: {e}", kernel.name)))
            })
            .collect();
        Ok(Box::new(Compiled { entries: entries?, _library: library }))
    }

    fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError> {
        let mut words = Vec::new();
        words.try_reserve_exact(bytes.div_ceil(8)).map_err(|_| {
            DeviceError(format!("{} MB of memory cannot be allocated", bytes >> 20))
        })?;
        words.resize(bytes.div_ceil(8), 0u64);
        Ok(Box::new(Words(UnsafeCell::new(words.into_boxed_slice()))))
    }
}

/// Memory of the host device, to which kernels write through a shared reference.
#[derive(Debug)]
struct Words(UnsafeCell<Box<[u64]>>);

impl Words {
    fn pointer(&self) -> *mut u64 {
        // SAFETY: no reference to the words outlives a call of `write` or `read`.
        unsafe { (*self.0.get()).as_mut_ptr() }
    }
}

impl Memory for Words {
    fn write(&mut self, at: usize, bytes: &[u8]) -> Result<(), DeviceError> {
        let all: &mut [u8] = bytemuck::cast_slice_mut(self.0.get_mut());
        all[at..at + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }

    fn read(&self, bytes: &mut [u8]) -> Result<(), DeviceError> {
        // SAFETY: a launch returns after all its items are complete, so that no kernel writes during this call. The
        // memory is `Send` but not `Sync`.
        let words: &[u64] = unsafe { &*self.0.get() };
        bytes.copy_from_slice(&bytemuck::cast_slice(words)[..bytes.len()]);
        Ok(())
    }
}

/// Compiled kernel, which processes the items from `first` to `last − 1`. `arguments` points to its arguments.
type Entry = unsafe extern "C" fn(first: u64, last: u64, arguments: *const *const c_void);

#[derive(Debug)]
struct Compiled {
    entries: Vec<Entry>,
    /// Library that contains the code of `entries`; it must stay loaded while `entries` are used.
    _library: Library,
}

/// Argument pointers, shared by the tasks of a launch.
struct Shared<'a>(&'a [*const c_void]);

// SAFETY: the pointers are only read; the memory behind them is written at indices that differ between items.
unsafe impl Sync for Shared<'_> {}

impl Shared<'_> {
    fn pointer(&self) -> *const *const c_void {
        self.0.as_ptr()
    }
}

impl Program for Compiled {
    fn launch(
        &self,
        kernel: usize,
        items: usize,
        arguments: &[Argument],
    ) -> Result<(), DeviceError> {
        let pointers: Result<Vec<*const c_void>, DeviceError> = arguments
            .iter()
            .map(|argument| match argument {
                Argument::Memory(memory) => {
                    let memory: &dyn Any = *memory;
                    let words = memory.downcast_ref::<Words>();
                    words.map(|words| words.pointer().cast_const().cast()).ok_or_else(|| {
                        DeviceError("a kernel argument is memory of another device".into())
                    })
                }
                Argument::Index(number) => Ok(std::ptr::from_ref(number).cast()),
                Argument::Real(number) => Ok(std::ptr::from_ref(number).cast()),
            })
            .collect();
        let (entry, pointers) = (self.entries[kernel], pointers?);
        let shared = Shared(&pointers);
        (0..items.div_ceil(ITEMS)).into_par_iter().for_each(|task| {
            let (first, last) = (task * ITEMS, items.min((task + 1) * ITEMS));
            // SAFETY: the caller must pass the arguments that the kernel declares, and arrays that are long enough
            // for this number of items.
            unsafe { entry(first as u64, last as u64, shared.pointer()) };
        });
        Ok(())
    }
}
