//! Product with the matrix-free tangent on the elements of a chunk.
//!
//! The compiler inlines SIMD intrinsics beyond the baseline only into functions that are themselves inlined.
//! Registers are therefore filled by loops, and not by closures such as the argument of `array::from_fn`.

use faer::traits::pulp::{Simd, WithSimd};

use super::element_product::ElementProduct;
use super::kinds::{PerKind, for_kind};
use super::lanes::{Rows, Stored};
use crate::operator::kernel::DataLayout;
use crate::operator::layout::{Aligned, Chunk, LANES, Layout};

/// Product y += A x on the elements of a chunk; x and y are the values of the chunk's nodes.
pub(super) struct ChunkProduct<'a, T: Stored> {
    pub(super) layout: &'a Layout,
    pub(super) chunk: &'a Chunk,
    /// Stored data of the tangents of the chunk's elements.
    pub(super) data: &'a [T::Pack],
    pub(super) x: &'a [Aligned],
    pub(super) y: &'a mut [Aligned],
}

impl<T: Stored> WithSimd for ChunkProduct<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for_kind(&self.layout.rule, self.chunk.plain, Elements { chunk: self, simd });
    }
}

/// Elements of a chunk, and the instruction set for them.
struct Elements<'a, T: Stored, S> {
    chunk: ChunkProduct<'a, T>,
    simd: S,
}

impl<T: Stored, S: Simd> PerKind for Elements<'_, T, S> {
    type Output = ();

    #[inline(always)]
    fn for_kind<
        const PLAIN: bool,
        const N: usize,
        const C: usize,
        const D: usize,
        const L: usize,
    >(
        self,
    ) {
        self.chunk.elements::<S, PLAIN, N, C, D, L>(self.simd);
    }
}

impl<T: Stored> ChunkProduct<'_, T> {
    /// Computes the product for elements with `N` nodes, `C` fields per node (three displacements, and damage if
    /// there is any), `D` damage points and `L` stored entries of the damage terms without gradients.
    #[inline(always)]
    fn elements<
        S: Simd,
        const PLAIN: bool,
        const N: usize,
        const C: usize,
        const D: usize,
        const L: usize,
    >(
        self,
        simd: S,
    ) {
        let zero = T::splat(simd, 0.0);
        let lanes = T::lanes::<S>();
        let rule = &self.layout.rule;
        let layout = DataLayout::for_kind(rule.elastic_points.len(), D, L, PLAIN);
        let width = layout.with_extra(!PLAIN && rule.extra.stored).width();
        // the nodal values of a linear element fit into registers, the nodal values of a quadratic element do not
        let rows_at_once = if N == 4 { lanes } else { LANES };
        for (batch, local) in self.chunk.local.chunks_exact(N).enumerate() {
            for first in (0..LANES).step_by(rows_at_once) {
                let mut rows = [Rows([[T::default(); 4]; LANES]); N];
                for a in 0..N {
                    for row in 0..rows_at_once {
                        let value = &self.x[usize::from(local[a][first + row])].0;
                        for c in 0..4 {
                            rows[a].0[row][c] = T::narrow(value[c]);
                        }
                    }
                }
                for register in 0..rows_at_once / lanes {
                    let mut u = [[zero; C]; N];
                    for a in 0..N {
                        let columns = T::columns(simd, &rows[a], register);
                        u[a].copy_from_slice(&columns[..C]);
                    }
                    let lane = first + register * lanes;
                    let product = ElementProduct::<T, S, PLAIN, C, D, L> {
                        layout: self.layout,
                        simd,
                        register: lane / lanes,
                        data: &self.data[(batch * LANES + lane) / T::WIDTH * width..],
                    };
                    let r = if N == 4 { product.linear(&u) } else { product.quadratic(&u) };
                    for a in 0..N {
                        let mut columns = [zero; 4];
                        columns[..C].copy_from_slice(&r[a]);
                        T::rows(simd, &columns, &mut rows[a], register);
                    }
                }
                for a in 0..N {
                    for row in 0..rows_at_once {
                        // a local copy, so that the compiler merges the four additions into one instruction
                        let value = &mut self.y[usize::from(local[a][first + row])].0;
                        let mut sum = *value;
                        for c in 0..4 {
                            sum[c] += rows[a].0[row][c].widen();
                        }
                        *value = sum;
                    }
                }
            }
        }
    }
}
