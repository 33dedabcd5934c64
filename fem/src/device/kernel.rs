//! Kernels, and their source code for the compilers of all devices.

/// Kernel: C code that processes one of many independent items.
#[derive(Clone, Debug)]
pub struct Kernel {
    pub name: String,
    /// C types and names of the parameters. Allowed types: pointers, `index` and `double`.
    pub parameters: Vec<(&'static str, String)>,
    /// C statements; the variable `at` is the index of the item.
    pub body: String,
    /// C functions that the body calls. Identical functions of several kernels are emitted only once.
    pub functions: Vec<String>,
}

impl Kernel {
    /// Creates a kernel that calls no C functions.
    pub fn new(
        name: impl Into<String>,
        parameters: &[(&'static str, &str)],
        body: impl Into<String>,
    ) -> Self {
        let parameters = parameters.iter().map(|&(kind, name)| (kind, name.to_string())).collect();
        Self { name: name.into(), parameters, body: body.into(), functions: Vec::new() }
    }

    /// Returns the kernel with the C functions that it calls.
    pub fn calling(self, functions: Vec<String>) -> Self {
        Self { functions, ..self }
    }
}

/// C definitions at the beginning of each source file.
const PRELUDE: &str = "\
typedef unsigned long long index;
#define restrict __restrict__
#ifdef __CUDACC__
#define ITEM static __device__ __forceinline__ void
#else
#include <math.h>
#define ITEM static inline void
#endif
";

/// Returns the source code of the kernels. For a GPU, each kernel is a `__global__` function of its name, with one
/// thread per item. For the host, each kernel is a function that processes the items from `first` to `last − 1`; its
/// last parameter is an array of pointers to the arguments of the kernel.
pub fn source(kernels: &[Kernel]) -> String {
    let mut out = String::from(PRELUDE);
    let mut functions: Vec<&String> = kernels.iter().flat_map(|k| &k.functions).collect();
    functions.sort_unstable();
    functions.dedup();
    functions.into_iter().for_each(|function| out += &format!("\n{function}"));
    for Kernel { name, parameters, body, .. } in kernels {
        let declared: String =
            parameters.iter().map(|(kind, name)| format!(", {}", declare(kind, name))).collect();
        let given: String = parameters.iter().map(|(_, name)| format!(", {name}")).collect();
        let unpacked: String = parameters
            .iter()
            .enumerate()
            .map(|(k, (kind, _))| match kind.ends_with('*') {
                true => format!(", ({kind})arguments[{k}]"),
                false => format!(", *(const {kind} *)arguments[{k}]"),
            })
            .collect();
        out += &format!(
            "\nITEM {name}_item(index at{declared}) {{\n{body}}}\n\
             #ifdef __CUDACC__\n\
             extern \"C\" __global__ void {name}(index items{declared}) {{\n    \
             index at = blockIdx.x * (index)blockDim.x + threadIdx.x;\n    \
             if (at < items) {name}_item(at{given});\n}}\n\
             #else\n\
             void {name}(index first, index last, const void *const *arguments) {{\n    \
             for (index at = first; at < last; at++) {name}_item(at{unpacked});\n}}\n\
             #endif\n"
        );
    }
    out
}

/// Returns the C declaration of a parameter.
fn declare(kind: &str, name: &str) -> String {
    if kind.ends_with('*') { format!("{kind}restrict {name}") } else { format!("{kind} {name}") }
}
