//! C kernels for the product with the tangents of elements, recorded from the code of the processor.

use std::fmt::Write;

use faer::traits::pulp::Scalar;

use crate::device::Kernel;
use crate::material::{Term, begin, statements};
use crate::operator::cpu::{ElementProduct, Pack, PerKind, Stored, for_kind};
use crate::operator::kernel::DataLayout;
use crate::operator::layout::Layout;

/// Creates the kernel of the product for plain or for other elements, with one element per item. The kernel's
/// parameter `first` is the first slot of this kind. The kernel reads node a of slot s at `nodes[a · slots + s]`, and
/// the stored data in the packs of the processor. It writes the contribution of slot s to node a as four values at
/// index `a · slots + s` of `copies`.
pub(crate) fn product_kernel(layout: &Layout, plain: bool, stored: StoredType) -> Kernel {
    begin();
    let nodes = layout.rule.nodes;
    let width = DataLayout::new(&layout.rule, plain).width();
    let product = for_kind(&layout.rule, plain, Recorded { layout });
    let fields = product.len() / nodes;
    let (lines, results) = statements(&product, &|input| match input.checked_sub(4 * nodes) {
        None => format!("n{}[{}]", input / 4, input % 4),
        Some(k) => stored.entry(k),
    });
    let mut body = stored.declare(stored.read, width);
    for a in 0..nodes {
        let node =
            format!("    const double *n{a} = x + 4 * (index)nodes[{a} * slots + first + at];");
        writeln!(body, "{node}").expect("writing to a string cannot fail");
    }
    body += &lines;
    for a in 0..nodes {
        for c in 0..4 {
            let value = if c < fields { results[a * fields + c].as_str() } else { "0.0" };
            let copy = format!("    copies[4 * ({a} * slots + first + at) + {c}] = {value};");
            writeln!(body, "{copy}").expect("writing to a string cannot fail");
        }
    }
    let name = if plain { "plain_product" } else { "product" };
    let parameters = [
        ("index", "slots"),
        ("index", "first"),
        ("const unsigned *", "nodes"),
        (stored.read, "data"),
        ("const double *", "x"),
        ("double *", "copies"),
    ];
    Kernel::new(name, &parameters, body)
}

/// Creates the kernels of both kinds and precisions, for a test.
pub fn product_kernels(layout: &Layout) -> Vec<Kernel> {
    let single = [true, false].map(|plain| product_kernel(layout, plain, StoredType::new::<f32>()));
    let double = [true, false].map(|plain| product_kernel(layout, plain, StoredType::new::<f64>()));
    let double = double.map(|k| Kernel { name: format!("double_{}", k.name), ..k });
    single.into_iter().chain(double).collect()
}

/// Computation that records the product for one element. Its result contains all fields of the
/// first node, then all fields of the second node, and so on.
struct Recorded<'a> {
    layout: &'a Layout,
}

impl PerKind for Recorded<'_> {
    type Output = Vec<Term>;

    fn for_kind<
        const PLAIN: bool,
        const N: usize,
        const C: usize,
        const D: usize,
        const L: usize,
    >(
        self,
    ) -> Vec<Term> {
        let width = DataLayout::new(&self.layout.rule, PLAIN).width();
        let mut u = [[Term::default(); C]; N];
        for a in 0..N {
            for c in 0..C {
                u[a][c] = Term::given(4 * a + c);
            }
        }
        let data: Vec<Pack<Term, 1>> =
            (0..width).map(|k| Pack::splat(Term::given(4 * N + k))).collect();
        let product = ElementProduct::<Term, Scalar, PLAIN, C, D, L> {
            layout: self.layout,
            simd: Scalar::new(),
            register: 0,
            data: &data,
        };
        let r = if N == 4 { product.linear(&u) } else { product.quadratic(&u) };
        r.as_flattened().to_vec()
    }
}

/// C declarations for the stored data of an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredType {
    /// Pointer type for reading.
    pub read: &'static str,
    /// Pointer type for writing.
    pub write: &'static str,
    /// Number of elements per pack.
    pub lanes: usize,
}

impl StoredType {
    /// Creates the declarations for data of type `T`.
    pub(crate) fn new<T: Stored>() -> Self {
        let [read, write] = if size_of::<T>() == 4 {
            ["const float *", "float *"]
        } else {
            ["const double *", "double *"]
        };
        Self { read, write, lanes: T::WIDTH }
    }

    /// Returns the C statement that declares `entries`, a pointer to the stored data of the kernel's element.
    pub(crate) fn declare(&self, pointer: &str, width: usize) -> String {
        let lanes = self.lanes;
        format!(
            "    {pointer}entries = data + (at / {lanes} * {width} * {lanes} + at % {lanes});\n"
        )
    }

    /// Returns the C expression of entry k of the stored data.
    pub(crate) fn entry(&self, k: usize) -> String {
        format!("entries[{}]", self.lanes * k)
    }
}
