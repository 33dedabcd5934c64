//! The order of the nodes that keeps the factor sparse.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::error::FemError;
use crate::operator::neighbours;

/// Approximate minimum degree on the graph of the nodes: the unknowns of a node stay together, and
/// the graph is sixteen times smaller than that of the unknowns.
///
/// Reference: Amestoy, Davis & Duff, SIAM J. Matrix Anal. Appl. 17 (1996) 886,
/// doi:10.1137/S0895479894278952.
pub(crate) fn fill_reducing<const N: usize>(
    tets: &[[u32; N]],
    nodes: usize,
) -> Result<Vec<usize>, FemError> {
    let mut start = vec![0usize];
    let mut row = Vec::new();
    for near in neighbours(tets, nodes) {
        row.extend(near);
        start.push(row.len());
    }
    let failed = |reason: String| FemError::Factorisation { unknowns: 4 * nodes, reason };
    let graph = SymbolicSparseColMatRef::new_checked(nodes, nodes, &start, None, &row);
    let mut order = vec![0usize; nodes];
    let mut position = vec![0usize; nodes];
    let scratch = amd::order_scratch::<usize>(nodes, row.len());
    let mut memory = MemBuffer::try_new(scratch).map_err(|_| failed("out of memory".into()))?;
    amd::order(
        &mut order,
        &mut position,
        graph,
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .map_err(|e| failed(e.to_string()))?;
    Ok(order)
}
