//! Tangent that is applied element by element from stored data, without assembly of a matrix.
//!
//! The stored data of the elements of a batch are interleaved, so that one SIMD instruction processes several
//! elements. The instruction set is chosen at run time.

use std::sync::Arc;

use faer::traits::pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::chunk::ChunkProduct;
use super::lanes::{Stored, dispatch, lane_of_row};
use crate::device::DeviceError;
use crate::element::Rule;
use crate::material::{Inverted, Lanes, POINTS, SimdF64};
use crate::operator::equations::{Coupling, Operator, Product};
use crate::operator::increment::Increment;
use crate::operator::kernel::{DataLayout, diagonal, write_blocks};
use crate::operator::layout::{Aligned, Chunk, LANES, Layout, VACANT};
use crate::operator::pattern::{Block, Tangent};

/// Number of chunks of quadratic elements whose linear tangents are computed before any of them is added to the
/// result. The linear tangents of these chunks take 16 MB.
const AT_ONCE: usize = 16;
/// Smallest number of elements for which the tangent is stored in single precision, to save memory.
pub const SINGLE_FROM: usize = 400_000;

/// Creates a matrix-free product for a mesh. The number of elements `tets` determines the precision of the stored
/// data.
pub fn product(layout: Arc<Layout>, tets: usize) -> Box<dyn Product> {
    if tets < SINGLE_FROM {
        Box::new(MatrixFree::<f64>::new(layout))
    } else {
        Box::new(MatrixFree::<f32>::new(layout))
    }
}

/// Tangent that is applied from stored data, without an assembled matrix.
#[derive(Debug)]
pub(crate) struct MatrixFree<T: Stored> {
    layout: Arc<Layout>,
    /// Stored data of the tangents of the elements, one vector per chunk. A vector is ordered by batch,
    /// then by pack of the batch, then by entry of [`DataLayout`].
    data: Vec<Vec<T::Pack>>,
    /// For each element of a batch, its lane in the packs of the batch.
    lane_of_row: [usize; LANES],
    /// Results of a product at the nodes of each chunk. A node that belongs to several chunks has
    /// one result per chunk.
    copies: Vec<Aligned>,
}

impl<T: Stored> MatrixFree<T> {
    pub(crate) fn new(layout: Arc<Layout>) -> Self {
        let zeros = |chunk: &Chunk| {
            let width = DataLayout::new(&layout.rule, chunk.plain).width();
            vec![T::ZERO; chunk.tets.len() / T::WIDTH * width]
        };
        let data = layout.batches.chunks.iter().map(zeros).collect();
        Self { layout, data, lane_of_row: lane_of_row::<T>(), copies: Vec::new() }
    }

    /// Returns the stored data of the tangents, one vector per chunk of elements.
    pub(crate) fn data(&self) -> &[Vec<T::Pack>] {
        &self.data
    }

    pub(crate) fn data_mut(&mut self) -> &mut [Vec<T::Pack>] {
        &mut self.data
    }
}

impl<T: Stored> Product for MatrixFree<T> {
    fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted> {
        let Self { layout, data, lane_of_row, .. } = self;
        data.par_iter_mut().zip(&layout.batches.chunks).try_for_each(|(data, chunk)| {
            let width = DataLayout::new(&layout.rule, chunk.plain).width();
            let mut write = |batch: usize, tangent_data: &[[f64; LANES]]| {
                let data = &mut data[batch * (LANES / T::WIDTH) * width..];
                let tets = &chunk.tets[batch * LANES..];
                for (row, (&lane, &tet)) in lane_of_row.iter().zip(tets).enumerate() {
                    if tet == VACANT {
                        continue;
                    }
                    let packs = &mut data[lane / T::WIDTH * width..][..width];
                    for (pack, rows) in packs.iter_mut().zip(tangent_data) {
                        pack.as_mut()[lane % T::WIDTH] = T::narrow(rows[row]);
                    }
                }
            };
            operator.point_data(increment, coupling, &chunk.tets, &mut write)
        })
    }

    fn apply(&mut self, x: &[[f64; 4]], y: &mut [[f64; 4]]) -> Result<(), DeviceError> {
        let Self { layout, data, copies, .. } = self;
        layout.batches.gather(copies, y, |index, values, part| {
            let chunk = &layout.batches.chunks[index];
            values.clear();
            values.extend(chunk.global.iter().map(|&n| Aligned(x[n as usize])));
            dispatch(ChunkProduct::<T> { layout, chunk, data: &data[index], x: values, y: part });
        });
        Ok(())
    }

    fn diagonal(&mut self) -> Result<Vec<[f64; 4]>, DeviceError> {
        let Self { layout, data, lane_of_row, copies } = self;
        let mut out = vec![[0.0; 4]; layout.batches.node_count()];
        layout.batches.gather(copies, &mut out, |index, _, part| {
            let (chunk, data) = (&layout.batches.chunks[index], &data[index]);
            let mut add = |element: Position, a: usize, values: &[f64; 4]| {
                let node = chunk.local[element.batch * layout.rule.nodes + a][element.row];
                (0..4).for_each(|k| part[usize::from(node)].0[k] += values[k]);
            };
            let stored = ChunkData { rule: &layout.rule, chunk, data, lane_of_row };
            match layout.rule.nodes {
                4 => dispatch(Diagonal::<T, 4> { stored, add: &mut add }),
                _ => dispatch(Diagonal::<T, 10> { stored, add: &mut add }),
            }
        });
        Ok(out)
    }

    fn add_linear(&mut self, out: &mut Tangent) -> Result<(), DeviceError> {
        let rule = &self.layout.rule.linear();
        let of_chunk = |(chunk, data): (&Chunk, &Vec<T::Pack>)| {
            let mut elements: Vec<(u32, [[Block; 4]; 4])> = Vec::with_capacity(chunk.tets.len());
            let stored = ChunkData { rule, chunk, data, lane_of_row: &self.lane_of_row };
            dispatch(LinearTangents::<T> { stored, elements: &mut elements });
            elements
        };
        let chunks = &self.layout.batches.chunks;
        for (chunks, data) in chunks.chunks(AT_ONCE).zip(self.data.chunks(AT_ONCE)) {
            let elements: Vec<_> = chunks.par_iter().zip(data).map(of_chunk).collect();
            for (tet, blocks) in elements.iter().flatten() {
                let unsymmetric = rule.extra.unsymmetric;
                out.add_elements(*tet as usize, std::slice::from_ref(blocks), unsymmetric);
            }
        }
        Ok(())
    }

    #[cfg(feature = "bench-internals")]
    fn bytes(&self) -> usize {
        self.data.iter().map(|data| std::mem::size_of_val(data.as_slice())).sum()
    }
}

/// Stored data of a chunk, with the integration rule by which the data are read.
#[derive(Clone, Copy)]
struct ChunkData<'a, T: Stored> {
    rule: &'a Rule,
    chunk: &'a Chunk,
    data: &'a [T::Pack],
    lane_of_row: &'a [usize; LANES],
}

/// Position of an element in a chunk: index of the batch, and row within the batch.
#[derive(Clone, Copy)]
struct Position {
    batch: usize,
    row: usize,
}

impl<T: Stored> ChunkData<'_, T> {
    /// Returns the number of parts of the chunk. A part contains as many elements as one SIMD number has
    /// lanes.
    fn part_count<S: Simd>(&self) -> usize {
        self.chunk.tets.len() / SimdF64::<S>::COUNT
    }

    /// Loads the stored tangent data of the elements of a part of the chunk.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, part: usize, tangent_data: &mut [SimdF64<S>]) {
        let first = part * SimdF64::<S>::COUNT;
        let (batch, width) = (first / LANES, tangent_data.len());
        let data = &self.data[batch * (LANES / T::WIDTH) * width..];
        for (number, out) in tangent_data.iter_mut().enumerate() {
            let mut column = [0.0; POINTS];
            for lane in 0..SimdF64::<S>::COUNT {
                let lane_of_batch = first % LANES + lane;
                let pack = &data[lane_of_batch / T::WIDTH * width + number];
                column[lane] = pack.as_ref()[lane_of_batch % T::WIDTH].widen();
            }
            *out = SimdF64::load(simd, &column);
        }
    }

    /// Iterates over the elements of a part of the chunk, each with its SIMD lane, in the order of the chunk.
    /// Vacant lanes are omitted.
    fn elements<S: Simd>(&self, part: usize) -> impl Iterator<Item = (Position, usize)> {
        let first = part * SimdF64::<S>::COUNT;
        let (batch, begin) = (first / LANES, first % LANES);
        let lanes = self.lane_of_row.iter().map(move |lane| lane.wrapping_sub(begin)).enumerate();
        lanes
            .filter(|&(_, lane)| lane < SimdF64::<S>::COUNT)
            .map(move |(row, lane)| (Position { batch, row }, lane))
            .filter(move |(element, _)| self.chunk.tets[batch * LANES + element.row] != VACANT)
    }
}

/// Computation of the diagonal of each element. `add` is called with the element, the node number within the element,
/// and the four diagonal values of this node.
struct Diagonal<'a, T: Stored, const N: usize> {
    stored: ChunkData<'a, T>,
    add: &'a mut dyn FnMut(Position, usize, &[f64; 4]),
}

impl<T: Stored, const N: usize> WithSimd for Diagonal<'_, T, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { stored, add } = self;
        let plain = stored.chunk.plain;
        let width = DataLayout::new(stored.rule, plain).width();
        let mut tangent_data = vec![SimdF64::<S>::splat(simd, 0.0); width];
        for part in 0..stored.part_count::<S>() {
            stored.load(simd, part, &mut tangent_data);
            let diagonal = diagonal::<SimdF64<S>, N>(stored.rule, plain, &tangent_data);
            for a in 0..N {
                let mut columns = [[0.0; POINTS]; 4];
                for k in 0..4 {
                    diagonal[a][k].store(&mut columns[k]);
                }
                for (element, lane) in stored.elements::<S>(part) {
                    add(element, a, &[0, 1, 2, 3].map(|k| columns[k][lane]));
                }
            }
        }
    }
}

/// Computation of the tangents of linear shape functions on the elements of a chunk. `elements` receives element
/// number and blocks.
struct LinearTangents<'a, T: Stored> {
    stored: ChunkData<'a, T>,
    elements: &'a mut Vec<(u32, [[Block; 4]; 4])>,
}

impl<T: Stored> WithSimd for LinearTangents<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { stored, elements } = self;
        let plain = stored.chunk.plain;
        let width = DataLayout::new(stored.rule, plain).width();
        let mut tangent_data = vec![SimdF64::<S>::splat(simd, 0.0); width];
        for part in 0..stored.part_count::<S>() {
            stored.load(simd, part, &mut tangent_data);
            let mut blocks = [[[[SimdF64::<S>::splat(simd, 0.0); 4]; 4]; 4]; 4];
            write_blocks::<SimdF64<S>, false, 4>(stored.rule, plain, &tangent_data, &mut blocks);
            let first = elements.len();
            let tets = stored
                .elements::<S>(part)
                .map(|(at, lane)| (stored.chunk.tets[at.batch * LANES + at.row], lane));
            let tets: Vec<(u32, usize)> = tets.collect();
            elements.extend(tets.iter().map(|(tet, _)| (*tet, [[[[0.0; 4]; 4]; 4]; 4])));
            let unsymmetric = stored.rule.extra.unsymmetric;
            for a in 0..4 {
                for b in 0..=if unsymmetric { 3 } else { a } {
                    for i in 0..4 {
                        for j in 0..4 {
                            let mut column = [0.0; POINTS];
                            blocks[a][b][i][j].store(&mut column);
                            for (element, (_, lane)) in elements[first..].iter_mut().zip(&tets) {
                                element.1[a][b][i][j] = column[*lane];
                            }
                        }
                    }
                }
            }
        }
    }
}
