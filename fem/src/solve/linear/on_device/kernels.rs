//! Device kernels of the multigrid levels and of the Krylov methods, in C.

use std::sync::Arc;

use bytemuck::Pod;

use crate::device::{Argument, ComputeDevice, DeviceError, Kernel, Program};

/// A sum over a vector is computed in two stages. This is the largest number of partial sums that the first stage
/// computes.
pub(super) const PARTS: usize = 1 << 16;
/// A sum over a vector is computed in two stages. This is the number of partial sums that the second stage computes;
/// the host adds these partial sums.
pub(super) const LAST_PARTS: usize = 256;

/// Block sizes R × C of the matrices of the hierarchy.
const BLOCKS: [[usize; 2]; 5] = [[3, 3], [3, 6], [6, 3], [6, 6], [1, 1]];

type Parameters = &'static [(&'static str, &'static str)];

/// Type of the entries of a vector, with the names of its kernels.
pub(super) trait DeviceReal: Pod + std::fmt::Debug {
    const CLEAR: &'static str;
    const COPY: &'static str;
}

impl DeviceReal for f32 {
    const CLEAR: &'static str = "clear_single";
    const COPY: &'static str = "copy_single";
}

impl DeviceReal for f64 {
    const CLEAR: &'static str = "clear";
    const COPY: &'static str = "copy";
}

/// Kernels of vector operations: name, parameters and body. In a body, `at` is the number of the work item.
const VECTORS: [(&str, Parameters, &str); 22] = [
    ("clear", &[("double *", "x")], "x[at] = 0.0;"),
    ("clear_single", &[("float *", "x")], "x[at] = 0.0f;"),
    ("copy", &[("const double *", "x"), ("double *", "y")], "y[at] = x[at];"),
    ("copy_single", &[("const float *", "x"), ("float *", "y")], "y[at] = x[at];"),
    ("scale", &[("double", "a"), ("double *", "x")], "x[at] = a * x[at];"),
    (
        "dot",
        &[("index", "n"), ("const double *", "a"), ("const double *", "b"), ("double *", "parts")],
        "double sum = 0.0;\n    \
         for (index i = at; i < n; i += PARTS) sum += a[i] * b[i];\n    parts[at] = sum;",
    ),
    (
        "recur",
        &[
            ("double", "a"),
            ("double", "b"),
            ("const double *", "w"),
            ("const double *", "d"),
            ("double *", "y"),
        ],
        "y[at] = -w[at] - a * d[at] - b * y[at];",
    ),
    (
        "add_scaled",
        &[("double", "a"), ("const double *", "x"), ("double *", "y")],
        "y[at] += a * x[at];",
    ),
    (
        "scale_and_add",
        &[("double", "a"), ("const double *", "x"), ("double *", "y")],
        "y[at] = x[at] + a * y[at];",
    ),
    (
        "weighted_dot",
        &[
            ("index", "n"),
            ("const double *", "w"),
            ("const double *", "a"),
            ("const double *", "b"),
            ("double *", "parts"),
        ],
        "double sum = 0.0;\n    \
         for (index i = at; i < n; i += PARTS) sum += w[i] * a[i] * b[i];\n    parts[at] = sum;",
    ),
    (
        "sum_of_parts",
        &[("index", "count"), ("const double *", "parts"), ("double *", "last")],
        "double sum = 0.0;\n    \
         for (index i = at; i < count; i += LAST_PARTS) sum += parts[i];\n    last[at] = sum;",
    ),
    (
        "largest",
        &[
            ("index", "nodes"),
            ("index", "first"),
            ("index", "fields"),
            ("const double *", "r"),
            ("double *", "parts"),
        ],
        "double most = 0.0;\n    for (index n = at; n < nodes; n += PARTS)\n        \
         for (index k = first; k < first + fields; k++) most = fmax(most, fabs(r[4 * n + k]));\n    \
         parts[at] = most;",
    ),
    (
        "largest_of_parts",
        &[("index", "count"), ("const double *", "parts"), ("double *", "last")],
        "double most = 0.0;\n    \
         for (index i = at; i < count; i += LAST_PARTS) most = fmax(most, parts[i]);\n    \
         last[at] = most;",
    ),
    // a single work item computes the scale of a vector (its largest absolute value, or 1 for a zero vector) from
    // partial results
    (
        "scale_of_last_parts",
        &[("const double *", "last"), ("double *", "scale")],
        "double most = 0.0;\n    \
         for (index i = 0; i < LAST_PARTS; i++) most = fmax(most, last[i]);\n    \
         scale[at] = most > 0.0 ? most : 1.0;",
    ),
    (
        "narrow",
        &[
            ("index", "first"),
            ("index", "fields"),
            ("const double *", "r"),
            ("const double *", "scale"),
            ("float *", "out"),
        ],
        "out[at] = (float)(r[4 * (at / fields) + first + at % fields] / scale[0]);",
    ),
    (
        "widen",
        &[
            ("index", "first"),
            ("index", "fields"),
            ("const float *", "x"),
            ("const double *", "scale"),
            ("double *", "z"),
        ],
        "index later = 4 - first, node = at / later, k = at % later;\n    \
         z[4 * node + first + k] = k < fields ? scale[0] * (double)x[fields * node + k] : 0.0;",
    ),
    (
        "mask",
        &[("const unsigned char *", "free"), ("double *", "x")],
        "if (!free[at]) x[at] = 0.0;",
    ),
    // step of the Chebyshev smoother that scales residuals by the diagonal (not by the diagonal blocks) of the matrix
    (
        "smooth",
        &[
            ("double", "momentum"),
            ("double", "weight"),
            ("const double *", "w"),
            ("const double *", "r"),
            ("double *", "step"),
            ("double *", "x"),
        ],
        "double before = momentum == 0.0 ? 0.0 : momentum * step[at];\n    \
         step[at] = before + weight * (w[at] * r[at]);\n    x[at] += step[at];",
    ),
    (
        "contact",
        &[
            ("const unsigned *", "node"),
            ("const double *", "block"),
            ("const double *", "x"),
            ("double *", "y"),
        ],
        "index n = node[at];\n    for (int i = 0; i < 3; i++) {\n        double sum = 0.0;\n        \
         for (int j = 0; j < 3; j++) sum += block[9 * at + 3 * i + j] * x[4 * n + j];\n        \
         y[4 * n + i] += sum;\n    }",
    ),
    // adds half of the residual at each midpoint to the residual at both vertices of its edge
    (
        "restrict_to_vertices",
        &[
            ("index", "vertices"),
            ("const unsigned *", "start"),
            ("const unsigned *", "midpoint"),
            ("const unsigned char *", "free"),
            ("const double *", "r"),
            ("double *", "out"),
        ],
        "index vertex = at / 4, c = at % 4;\n    double sum = r[at];\n    \
         for (index k = start[vertex]; k < start[vertex + 1]; k++) \
         sum += 0.5 * r[4 * (vertices + midpoint[k]) + c];\n    out[at] = free[at] ? sum : 0.0;",
    ),
    (
        "add_from_vertices",
        &[
            ("index", "vertices"),
            ("const unsigned *", "parents"),
            ("const unsigned char *", "free"),
            ("const double *", "correction"),
            ("double *", "z"),
        ],
        "index node = at / 4, c = at % 4;\n    double value;\n    \
         if (node < vertices) value = correction[at];\n    else {\n        \
         const unsigned *ends = parents + 2 * (node - vertices);\n        \
         value = 0.5 * (correction[4 * (index)ends[0] + c] + correction[4 * (index)ends[1] + c]);\n    \
         }\n    if (free[at]) z[at] += value;",
    ),
    // product with the dense inverse of the matrix of the coarsest level
    (
        "dense",
        &[("index", "n"), ("const double *", "inverse"), ("const float *", "b"), ("float *", "x")],
        "double sum = 0.0;\n    \
         for (index j = 0; j < n; j++) sum += inverse[n * at + j] * (double)b[j];\n    \
         x[at] = (float)sum;",
    ),
];

/// Returns the kernels of matrices A of R × C blocks: y = A x, y += A x, y −= A x, and a step of the Chebyshev
/// smoother.
fn matrices() -> Vec<Kernel> {
    let mut kernels = Vec::new();
    for [r, c] in BLOCKS {
        for (name, into) in [("set", "="), ("add", "+="), ("subtract", "-=")] {
            let body = format!(
                "    index row = at / {r}, i = at % {r};\n    float sum = 0.0f;\n    \
                 for (index k = start[row]; k < start[row + 1]; k++) {{\n        \
                 const float *b = block + {size} * k + {c} * i, *v = x + {c} * (index)column[k];\n        \
                 for (int j = 0; j < {c}; j++) sum += b[j] * v[j];\n    }}\n    y[at] {into} sum;\n",
                size = r * c,
            );
            let parameters = [
                ("const unsigned *", "start"),
                ("const unsigned *", "column"),
                ("const float *", "block"),
                ("const float *", "x"),
                ("float *", "y"),
            ];
            kernels.push(Kernel::new(format!("{name}_{r}_{c}"), &parameters, body));
        }
        if r == c {
            let body = format!(
                "    index row = at / {r}, i = at % {r};\n    float scaled = 0.0f;\n    \
                 for (int j = 0; j < {r}; j++) \
                 scaled += inverse[{size} * row + {r} * i + j] * r[{r} * row + j];\n    \
                 float before = momentum == 0.0 ? 0.0f : (float)momentum * step[at];\n    \
                 step[at] = before + (float)weight * scaled;\n    \
                 x[at] += step[at];\n",
                size = r * r,
            );
            let parameters = [
                ("double", "momentum"),
                ("double", "weight"),
                ("const float *", "inverse"),
                ("const float *", "r"),
                ("float *", "step"),
                ("float *", "x"),
            ];
            kernels.push(Kernel::new(format!("smooth_{r}"), &parameters, body));
        }
    }
    kernels
}

/// Returns all kernels. The number of partial sums is fixed, so that sums have the same rounding errors on all devices.
pub(super) fn kernels() -> Vec<Kernel> {
    let with_counts = |body: &str| {
        let body = body.replace("LAST_PARTS", &LAST_PARTS.to_string());
        format!("    {}\n", body.replace("PARTS", &PARTS.to_string()))
    };
    let vectors = VECTORS
        .iter()
        .map(|(name, parameters, body)| Kernel::new(*name, parameters, with_counts(body)));
    vectors.chain(matrices()).collect()
}

#[cfg(test)]
#[path = "../../../../tests/support/nvrtc.rs"]
mod nvrtc;

#[cfg(test)]
#[test]
fn the_kernels_compile_for_a_graphics_card() {
    nvrtc::assert_compiles_for_a_card(&crate::device::source(&kernels()));
}

/// Compiled kernels of a device.
#[derive(Debug)]
pub(super) struct Kernels {
    names: Vec<String>,
    program: Arc<dyn Program>,
}

impl Kernels {
    pub(super) fn new(device: &ComputeDevice) -> Result<Self, DeviceError> {
        let kernels = kernels();
        let program = device.compile(&kernels)?;
        Ok(Self { names: kernels.into_iter().map(|kernel| kernel.name).collect(), program })
    }

    pub(super) fn launch(
        &self,
        name: &str,
        items: usize,
        arguments: &[Argument],
    ) -> Result<(), DeviceError> {
        let kernel = self.names.iter().position(|kernel_name| kernel_name == name);
        let kernel =
            kernel.unwrap_or_else(|| unreachable!("there is no kernel with the name {name}"));
        self.program.launch(kernel, items, arguments)
    }
}
