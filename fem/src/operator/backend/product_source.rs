//! The product with the tangents of elements as a kernel of C, recorded from that of the processor.

use std::fmt::Write;

use faer::traits::pulp::Scalar;

use super::apply::ElementProduct;
use super::kinds::{OfKind, of_kind};
use super::lanes::{Pack, Stored};
use super::recording::{Term, begin, statements};
use crate::device::Kernel;
use crate::operator::layout::Layout;
use crate::operator::point_data::PointData;

/// The kernel of elements that are plain or not, whose slots begin at `first`, one an item. It reads the
/// nodes of slot s at `nodes[a slots + s]`, its numbers in packs as the processor stores them, and
/// writes what it adds to its node a to the four values at place `a slots + s` of `copies`.
pub(super) fn product_kernel<T: Stored>(layout: &Layout, plain: bool) -> Kernel {
    begin();
    of_kind(&layout.rule, plain, Source::<T> { layout, plain, stored: std::marker::PhantomData })
}

/// Those of both kinds and precisions, for their test.
#[cfg(test)]
pub(crate) fn product_kernels(layout: &Layout) -> Vec<Kernel> {
    let single = [true, false].map(|plain| product_kernel::<f32>(layout, plain));
    let double = [true, false].map(|plain| product_kernel::<f64>(layout, plain));
    let double = double.map(|k| Kernel { name: format!("double_{}", k.name), ..k });
    single.into_iter().chain(double).collect()
}

struct Source<'a, T> {
    layout: &'a Layout,
    plain: bool,
    stored: std::marker::PhantomData<T>,
}

impl<T: Stored> OfKind for Source<'_, T> {
    type Output = Kernel;

    fn of_kind<
        const PLAIN: bool,
        const N: usize,
        const C: usize,
        const D: usize,
        const L: usize,
    >(
        self,
    ) -> Kernel {
        let width = PointData::of(&self.layout.rule, PLAIN).width();
        let mut u = [[Term::default(); C]; N];
        for a in 0..N {
            for c in 0..C {
                u[a][c] = Term::given(4 * a + c);
            }
        }
        let data: Vec<Pack<Term, 1>> =
            (0..width).map(|k| Pack::of(Term::given(4 * N + k))).collect();
        let simd = Scalar::new();
        let product = ElementProduct::<Term, Scalar, PLAIN, C, D, L> {
            layout: self.layout,
            simd,
            register: 0,
            data: &data,
        };
        let r = if N == 4 { product.linear(&u) } else { product.quadratic(&u) };
        let [read, _] = pointers::<T>();
        let lanes = T::WIDTH;
        let (lines, results) =
            statements(r.as_flattened(), |place| match place.checked_sub(4 * N) {
                None => format!("n{}[{}]", place / 4, place % 4),
                Some(k) => format!("own[{}]", lanes * k),
            });
        let mut body = own::<T>(read, width);
        for a in 0..N {
            let node =
                format!("    const double *n{a} = x + 4 * (index)nodes[{a} * slots + first + at];");
            writeln!(body, "{node}").expect("a string takes all");
        }
        body += &lines;
        for a in 0..N {
            for c in 0..4 {
                let value = if c < C { results[a * C + c].as_str() } else { "0.0" };
                let copy = format!("    copies[4 * ({a} * slots + first + at) + {c}] = {value};");
                writeln!(body, "{copy}").expect("a string takes all");
            }
        }
        let name = if self.plain { "plain_product" } else { "product" };
        let parameters = [
            ("index", "slots"),
            ("index", "first"),
            ("const unsigned *", "nodes"),
            (read, "data"),
            ("const double *", "x"),
            ("double *", "copies"),
        ];
        Kernel::new(name, &parameters, body)
    }
}

/// Pointers of C to numbers as they are stored, to read them and to write them.
pub(super) fn pointers<T: Stored>() -> [&'static str; 2] {
    if size_of::<T>() == 4 { ["const float *", "float *"] } else { ["const double *", "double *"] }
}

/// The statement of C that finds the numbers of a kernel's element in their packs, as `own`.
pub(super) fn own<T: Stored>(pointer: &str, width: usize) -> String {
    let lanes = T::WIDTH;
    format!("    {pointer}own = data + (at / {lanes} * {width} * {lanes} + at % {lanes});\n")
}
