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

/// Whether threads pay for so many elements of `nodes` nodes.
fn worth_threads(elements: usize, nodes: usize) -> bool {
    elements * nodes >= WORTH && rayon::current_num_threads() > 1
}

/// Computes something for every element of `N` nodes and adds it in the order of the elements, so
/// that no sum depends on the number of threads.
///
/// `compute` writes what the elements from a number on give, at most [`LANES`] of them, and always
/// the same ones together; `add` gets the number of the first element and what it and those behind
/// it gave.
pub(super) fn deterministic_reduce<const N: usize, R: Clone + Send>(
    elements: usize,
    blank: R,
    compute: impl Fn(usize, &mut [R]) -> Result<(), Inverted> + Sync,
    mut add: impl FnMut(usize, &[R]),
) -> Result<(), Inverted> {
    let threads = worth_threads(elements, N);
    let size = if threads { (BLOCK / N).next_multiple_of(LANES) } else { LANES };
    let mut block = vec![blank; size];
    for first in (0..elements).step_by(size) {
        let block = &mut block[..size.min(elements - first)];
        let batches = |begin: usize, results: &mut [R]| {
            let mut batches = results.chunks_mut(LANES).enumerate();
            batches.try_for_each(|(b, results)| compute(begin + b * LANES, results))
        };
        if threads {
            block
                .par_chunks_mut(PIECE)
                .enumerate()
                .try_for_each(|(piece, results)| batches(first + piece * PIECE, results))?;
        } else {
            batches(first, block)?;
        }
        add(first, block);
    }
    Ok(())
}
