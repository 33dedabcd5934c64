//! Computations on elements: residual, tangent, stored data, stresses, state.

use faer::traits::pulp::Simd;

use super::gather::{check, store_rows};
use super::lanes::Rows as Batch;
use super::registers::{Elements, Evaluate, Rows};
use crate::element::Rule;
use crate::material::{Inverted, Lanes, POINTS, SimdF64};
use crate::operator::cell_stress::CellStress;
use crate::operator::kernel::{
    DataLayout, ElementResidual, STRESS_SUMS, configurational, linearise, residual, stress_sums,
    write_blocks,
};
use crate::operator::layout::LANES;
use crate::operator::pattern::Block;

/// Computation of the residuals and energies of the elements.
#[derive(Debug)]
pub(crate) struct ResidualsOf<'a, const N: usize>(pub &'a mut [ElementResidual<f64, N>]);

impl<const N: usize> Evaluate<N> for ResidualsOf<'_, N> {
    type Scratch<S: Simd> = ();

    fn scratch<S: Simd>(&self, _: S) {}

    #[inline(always)]
    fn evaluate<S: Simd>(
        &mut self,
        simd: S,
        elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        (): &mut (),
        rows: Rows<'_>,
    ) -> Result<(), Inverted> {
        let residual = residual(&elements, state);
        check(residual.sound)?;
        let mut batch = Batch([[0.0; 4]; LANES]);
        let out = &mut self.0[rows.first..][..rows.lanes.len()];
        for a in 0..N {
            store_rows(simd, &residual.nodal[a], &mut batch);
            for (out, row) in out.iter_mut().zip(&batch.0) {
                out.nodal[a] = *row;
            }
        }
        let mut column = [0.0; POINTS];
        for a in 0..N {
            residual.drive[a].store(&mut column);
            for (out, &lane) in out.iter_mut().zip(rows.lanes) {
                out.drive[a] = column[lane];
            }
        }
        for k in 0..3 {
            residual.energies[k].store(&mut column);
            for (out, &lane) in out.iter_mut().zip(rows.lanes) {
                out.energies[k] = column[lane];
            }
        }
        Ok(())
    }
}

/// Length of a buffer on the stack. The buffer has space for the stored data of a linear element, including
/// its principal axes, but not for the tangent terms of viscoelastic and plastic laws.
const FEW: usize = 51;

/// Buffer for the stored data of one register of elements. The data of linear elements without tangent terms of
/// inelastic laws fit into `few`, which is on the stack.
pub(crate) struct DataBuffers<S: Simd> {
    few: [SimdF64<S>; FEW],
    many: Vec<SimdF64<S>>,
    width: usize,
}

impl<S: Simd> DataBuffers<S> {
    #[inline(always)]
    fn new(simd: S, width: usize) -> Self {
        let zero = SimdF64::splat(simd, 0.0);
        let many = if width <= FEW { Vec::new() } else { vec![zero; width] };
        Self { few: [zero; FEW], many, width }
    }

    #[inline(always)]
    fn data(&mut self) -> &mut [SimdF64<S>] {
        if self.width <= FEW { &mut self.few[..self.width] } else { &mut self.many }
    }
}

/// Computation of the element matrices of the tangent.
#[derive(Debug)]
pub(crate) struct TangentsOf<'a, const N: usize> {
    pub rule: &'a Rule,
    /// Whether the coupling terms between u and φ are included.
    pub coupled: bool,
    pub out: &'a mut [[[Block; N]; N]],
}

impl<const N: usize> Evaluate<N> for TangentsOf<'_, N> {
    type Scratch<S: Simd> = DataBuffers<S>;

    #[inline(always)]
    fn scratch<S: Simd>(&self, simd: S) -> DataBuffers<S> {
        // sized for elements that are not plain, which have the most data
        DataBuffers::new(simd, DataLayout::new(self.rule, false).width_with_axes())
    }

    #[inline(always)]
    fn evaluate<S: Simd>(
        &mut self,
        simd: S,
        elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        scratch: &mut DataBuffers<S>,
        rows: Rows<'_>,
    ) -> Result<(), Inverted> {
        let data = scratch.data();
        check(linearise::<_, _, true, N>(&elements, self.coupled, data, state))?;
        let mut blocks = [[[[SimdF64::splat(simd, 0.0); 4]; 4]; N]; N];
        write_blocks::<SimdF64<S>, true, N>(self.rule, elements.plain, data, &mut blocks);
        let mut batch = Batch([[0.0; 4]; LANES]);
        let out = &mut self.out[rows.first..][..rows.lanes.len()];
        for a in 0..N {
            let last = if self.rule.extra.unsymmetric { N - 1 } else { a };
            for b in 0..=last {
                for i in 0..4 {
                    store_rows(simd, &blocks[a][b][i], &mut batch);
                    for (out, row) in out.iter_mut().zip(&batch.0) {
                        out[a][b][i] = *row;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Function that writes the stored data of a batch. Its arguments are the index of the batch and the data.
pub(crate) type WriteBatch<'a> = &'a mut dyn FnMut(usize, &[[f64; LANES]]);

/// Computation of the stored data of listed elements, batch by batch.
pub(crate) struct PointDataOf<'a> {
    pub rule: &'a Rule,
    /// Whether all listed elements are straight, none is a mixture, and no law adds viscoelastic or
    /// plastic terms to the tangent.
    pub plain: bool,
    pub coupled: bool,
    /// Number of listed elements.
    pub count: usize,
    pub write: WriteBatch<'a>,
}

impl<const N: usize> Evaluate<N> for PointDataOf<'_> {
    /// Stored data of one register, and stored data of a batch.
    type Scratch<S: Simd> = (Vec<SimdF64<S>>, Vec<[f64; LANES]>);

    #[inline(always)]
    fn scratch<S: Simd>(&self, simd: S) -> Self::Scratch<S> {
        let width = DataLayout::new(self.rule, self.plain).width();
        (vec![SimdF64::splat(simd, 0.0); width], vec![[0.0; LANES]; width])
    }

    #[inline(always)]
    fn evaluate<S: Simd>(
        &mut self,
        _: S,
        mut elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        (data, columns): &mut Self::Scratch<S>,
        rows: Rows<'_>,
    ) -> Result<(), Inverted> {
        elements.plain = self.plain;
        check(linearise::<_, _, false, N>(&elements, self.coupled, data, state))?;
        let count = SimdF64::<S>::COUNT;
        let begin = rows.first % LANES;
        for (out, value) in columns.iter_mut().zip(data.iter()) {
            let mut column = [0.0; POINTS];
            value.store(&mut column);
            out[begin..begin + count].copy_from_slice(&column[..count]);
        }
        let end = rows.first + rows.lanes.len();
        if end == self.count || end.is_multiple_of(LANES) {
            (self.write)(rows.first / LANES, columns);
        }
        Ok(())
    }
}

/// Computation of the mean stresses and energy densities of the elements.
#[derive(Debug)]
pub(crate) struct StressesOf<'a>(pub &'a mut [CellStress]);

impl<const N: usize> Evaluate<N> for StressesOf<'_> {
    type Scratch<S: Simd> = ();

    fn scratch<S: Simd>(&self, _: S) {}

    #[inline(always)]
    fn evaluate<S: Simd>(
        &mut self,
        _: S,
        elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        (): &mut (),
        rows: Rows<'_>,
    ) -> Result<(), Inverted> {
        let (sums, sound) = stress_sums(&elements, state);
        check(sound)?;
        let mut columns = [[0.0; POINTS]; STRESS_SUMS];
        for (sum, column) in sums.iter().zip(&mut columns) {
            sum.store(column);
        }
        for (out, &lane) in self.0[rows.first..].iter_mut().zip(rows.lanes) {
            *out = CellStress::new(columns.map(|column| column[lane]));
        }
        Ok(())
    }
}

/// Computation of the configurational forces of the elements' nodes.
#[derive(Debug)]
pub(crate) struct ConfigurationalOf<'a, const N: usize>(pub &'a mut [[[f64; 4]; N]]);

impl<const N: usize> Evaluate<N> for ConfigurationalOf<'_, N> {
    type Scratch<S: Simd> = ();

    fn scratch<S: Simd>(&self, _: S) {}

    #[inline(always)]
    fn evaluate<S: Simd>(
        &mut self,
        simd: S,
        elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        (): &mut (),
        rows: Rows<'_>,
    ) -> Result<(), Inverted> {
        let (nodal, sound) = configurational(&elements, state);
        check(sound)?;
        let mut batch = Batch([[0.0; 4]; LANES]);
        let out = &mut self.0[rows.first..][..rows.lanes.len()];
        for a in 0..N {
            store_rows(simd, &nodal[a], &mut batch);
            for (out, row) in out.iter_mut().zip(&batch.0) {
                out[a] = *row;
            }
        }
        Ok(())
    }
}

/// Computation of the state of the elements at the end of the increment. The state is ordered by
/// element and then by point.
#[derive(Debug)]
pub(crate) struct StatesOf<'a>(pub &'a mut [f64]);

impl<const N: usize> Evaluate<N> for StatesOf<'_> {
    type Scratch<S: Simd> = ();

    fn scratch<S: Simd>(&self, _: S) {}

    #[inline(always)]
    fn evaluate<S: Simd>(
        &mut self,
        _: S,
        elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        (): &mut (),
        rows: Rows<'_>,
    ) -> Result<(), Inverted> {
        check(elements.update(state))?;
        let width = state.len();
        for k in 0..width {
            let mut column = [0.0; POINTS];
            state[k].store(&mut column);
            let out = self.0[rows.first * width..].chunks_exact_mut(width);
            for (out, &lane) in out.zip(rows.lanes) {
                out[k] = column[lane];
            }
        }
        Ok(())
    }
}
