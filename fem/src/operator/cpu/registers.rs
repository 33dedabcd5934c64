//! Loop over elements, one SIMD register of elements after the other.

use faer::traits::pulp::{Simd, WithSimd};

use super::gather::{Buffers, Gather};
use super::lanes::dispatch;
use super::regions::ElementLaw;
use crate::material::{Inverted, Lanes, SimdF64};
use crate::operator::kernel::ElementState;
use crate::operator::layout::{LANES, VACANT};

/// Elements on which a computation is evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Selection<'a> {
    /// Consecutive elements. Their lanes are chosen so that [`Stored::rows`](super::lanes::Stored::rows) returns
    /// values in the order of the elements.
    Consecutive { first: usize, count: usize },
    /// Listed elements, one per SIMD lane. A vacant entry repeats the first element of its batch.
    Listed(&'a [u32]),
}

/// The elements of one SIMD register. A computation writes its results to the positions of these
/// elements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    /// Index of the first element in the selection.
    pub first: usize,
    /// Lane of each element of the selection that is in this register.
    pub lanes: &'a [usize],
}

/// State of the elements of a register.
pub(crate) type Elements<'a, S, const N: usize> =
    ElementState<'a, SimdF64<S>, ElementLaw<'a, SimdF64<S>>, N>;

/// Computation on the elements of one register, which writes a result for each element.
pub(crate) trait Evaluate<const N: usize> {
    /// Storage that is reused from register to register.
    type Scratch<S: Simd>;

    /// Creates the storage.
    fn scratch<S: Simd>(&self, simd: S) -> Self::Scratch<S>;

    /// Evaluates the elements of a register. `state` is storage for the state at the end of the increment, by elastic
    /// point.
    fn evaluate<S: Simd>(
        &mut self,
        simd: S,
        elements: Elements<'_, S, N>,
        state: &mut [SimdF64<S>],
        scratch: &mut Self::Scratch<S>,
        rows: Rows<'_>,
    ) -> Result<(), Inverted>;
}

/// Evaluates a computation on the selected elements.
pub(crate) fn each_register<const N: usize, W: Evaluate<N>>(
    gather: &Gather<'_, N>,
    selection: Selection<'_>,
    work: W,
) -> Result<(), Inverted> {
    dispatch(EachRegister { gather, selection, work })
}

struct EachRegister<'a, 'b, const N: usize, W> {
    gather: &'a Gather<'a, N>,
    selection: Selection<'b>,
    work: W,
}

impl<const N: usize, W: Evaluate<N>> WithSimd for EachRegister<'_, '_, N, W> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { gather, selection, mut work } = self;
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        let mut state = vec![SimdF64::<S>::splat(simd, 0.0); gather.element_state_len()];
        let mut scratch = work.scratch(simd);
        let (total, mut lane_of_row) = match selection {
            Selection::Consecutive { count, .. } => (count, gather.lane_of_row),
            Selection::Listed(tets) => (tets.len(), [0; LANES]),
        };
        if let Selection::Listed(_) = selection {
            for row in 0..LANES {
                lane_of_row[row] = row;
            }
        }
        for first in (0..total).step_by(SimdF64::<S>::COUNT) {
            let count = SimdF64::<S>::COUNT.min(total - first);
            // lanes without an element repeat the last element of the register
            let mut tets = [0; LANES];
            for row in 0..LANES {
                tets[lane_of_row[row]] = match selection {
                    Selection::Consecutive { first: start, .. } => {
                        start + first + row.min(count - 1)
                    }
                    Selection::Listed(list) => {
                        let listed = list[first + row.min(count - 1)];
                        let batch = list[first / LANES * LANES];
                        (if listed == VACANT { batch } else { listed }) as usize
                    }
                };
            }
            let elements = gather.elements(simd, tets, &mut buffers);
            let rows = Rows { first, lanes: &lane_of_row[..count] };
            work.evaluate(simd, elements, &mut state, &mut scratch, rows)?;
        }
        Ok(())
    }
}
