//! Mean stress and energy density of each element of a mesh.

use faer::traits::pulp::{Simd, WithSimd};

use super::gather::{Buffers, Gather, check};
use super::lanes::dispatch;
use crate::material::{Inverted, Lanes, POINTS, SimdF64};
use crate::operator::cell_stress::{CellStress, SUMS};

impl<const N: usize> Gather<'_, N> {
    /// The stresses of `out.len()` elements, beginning with element `first`.
    pub(super) fn stresses(&self, first: usize, out: &mut [CellStress]) -> Result<(), Inverted> {
        dispatch(Stresses { gather: self, first, out })
    }
}

struct Stresses<'a, 'b, const N: usize> {
    gather: &'a Gather<'a, N>,
    first: usize,
    out: &'b mut [CellStress],
}

impl<const N: usize> WithSimd for Stresses<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { gather, mut first, out } = self;
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        for out in out.chunks_mut(SimdF64::<S>::COUNT) {
            let tets = gather.rows(first, out.len());
            let (sums, sound) = gather.elements(simd, tets, &mut buffers).stress_sums();
            check(sound)?;
            let mut columns = [[0.0; POINTS]; SUMS];
            for (sum, column) in sums.iter().zip(&mut columns) {
                sum.store(column);
            }
            for (out, &place) in out.iter_mut().zip(&gather.places) {
                *out = CellStress::of(columns.map(|column| column[place]));
            }
            first += out.len();
        }
        Ok(())
    }
}
