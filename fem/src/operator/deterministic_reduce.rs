//! Multithreaded sums over all elements of a mesh whose result does not depend on the number of threads.

use rayon::prelude::*;

use super::layout::LANES;
use crate::material::Inverted;

/// Smallest number of element nodes (nodes per element times elements) for which several threads are used. Smaller
/// problems occur in ensembles, which run one problem per core.
const WORTH: usize = 100_000;
/// Number of element nodes per block. The results of a block are computed before they are added; with this size, the
/// results stay in the cache.
const BLOCK: usize = 8192;
/// Number of elements in one task of the thread pool.
const PIECE: usize = 8 * LANES;
/// Smallest number of tasks per thread in a block, for load balance.
const PIECES: usize = 4;

/// Computes a result for every element of `N` nodes and adds the results in the order of the elements, so that the
/// sums do not depend on the number of threads. `blank` is the initial value of a result.
///
/// `compute` gets the number of its first element and writes the results of at most [`LANES`] consecutive
/// elements. The grouping of elements is always the same. `add` gets the number of the first element and the
/// results of consecutive elements; it runs while the next results are computed.
pub(super) fn deterministic_reduce<const N: usize, R: Clone + Send + Sync>(
    elements: usize,
    blank: R,
    compute: impl Fn(usize, &mut [R]) -> Result<(), Inverted> + Sync,
    mut add: impl FnMut(usize, &[R]) + Send,
) -> Result<(), Inverted> {
    let batches = |begin: usize, results: &mut [R]| {
        let mut batches = results.chunks_mut(LANES).enumerate();
        batches.try_for_each(|(b, results)| compute(begin + b * LANES, results))
    };
    let threads = rayon::current_num_threads();
    if threads == 1 || elements * N < WORTH {
        let mut block = vec![blank; LANES];
        for first in (0..elements).step_by(LANES) {
            let block = &mut block[..LANES.min(elements - first)];
            batches(first, block)?;
            add(first, block);
        }
        return Ok(());
    }
    let size = (BLOCK / N).next_multiple_of(LANES).max(PIECES * PIECE * threads);
    let (mut block, mut before) = (vec![blank.clone(); size], vec![blank; size]);
    let mut added = 0..0;
    for first in (0..elements).step_by(size) {
        let next = first..elements.min(first + size);
        let (computed, ()) = rayon::join(
            || {
                let pieces = block[..next.len()].par_chunks_mut(PIECE).enumerate();
                let pieces = pieces.map(|(p, results)| (first + p * PIECE, results));
                pieces.try_for_each(|(begin, results)| batches(begin, results))
            },
            || {
                if !added.is_empty() {
                    add(added.start, &before[..added.len()]);
                }
            },
        );
        computed?;
        std::mem::swap(&mut block, &mut before);
        added = next;
    }
    add(added.start, &before[..added.len()]);
    Ok(())
}
