//! Sums over all elements of a mesh by several threads, with one result.

use rayon::prelude::*;

use super::layout::LANES;
use crate::material::Inverted;

/// Nodes of elements (one counted for each element that has it) from which threads pay; smaller
/// problems are those of ensembles, which have a run for every core.
const WORTH: usize = 100_000;
/// Nodes of elements that are computed before they are added: they stay in the cache.
const BLOCK: usize = 8192;
/// Elements that a thread takes at once.
const PIECE: usize = 8 * LANES;
/// Pieces of a block for each thread, so that none waits long for another.
const PIECES: usize = 4;

/// Computes something for every element of `N` nodes and adds it in the order of the elements, so
/// that no sum depends on the number of threads.
///
/// `compute` writes what the elements from a number on give, at most [`LANES`] of them, and always
/// the same ones together; `add` gets the number of the first element and what it and those behind
/// it gave, while the next ones are computed.
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
