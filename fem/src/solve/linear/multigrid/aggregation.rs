//! Aggregation of nodes, and the near null space (rigid-body modes) on the aggregates.
//!
//! Reference: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511.

use super::block_csr::BlockCsr;

/// Number of coarse unknowns per aggregate: one for each rigid-body mode.
pub(crate) const MODES: usize = 6;
/// Threshold of strong coupling: nodes i and j of the mesh are strongly coupled if ‖A_ij‖² > `STRONG`² ‖A_ii‖ ‖A_jj‖,
/// where A_ij is a block of the matrix.
const STRONG: f64 = 0.08;
/// Threshold of strong coupling between aggregates, on coarser levels.
///
/// An aggregate is coupled to about fifty other aggregates. This coupling is mostly weaker than the coupling of two
/// nodes of the mesh. If aggregates were coupled by the same threshold as nodes, the aggregates of the next level
/// would have only four members. The coarser levels would then have dense matrices and cost more than the finest
/// level, in particular on large meshes. The number of iterations is the same with both thresholds.
const STRONG_BELOW: f64 = 0.02;
const NONE: u32 = u32::MAX;

/// Returns the aggregate of each node, and the number of aggregates. `diagonal` contains the diagonal blocks of the
/// nodes that this rank owns; the matrix may have further nodes, which other ranks own.
pub(super) fn aggregates<const R: usize>(
    a: &BlockCsr<f64, R, R>,
    diagonal: &[[[f64; R]; R]],
) -> (Vec<u32>, usize) {
    let size = |b: &[[f64; R]; R]| b.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let n = diagonal.len();
    let strong_from = if R == MODES { STRONG_BELOW } else { STRONG };
    let diagonal_sizes: Vec<f64> = diagonal.iter().map(size).collect();
    let mut start = vec![0u32];
    let mut strong: Vec<(u32, f64)> = Vec::new();
    for i in 0..n {
        for (j, block) in a.row(i).filter(|(j, _)| *j != i && *j < n) {
            let coupling = size(block);
            let sizes = [i, j].map(|k| diagonal_sizes[k]);
            if coupling * coupling > strong_from * strong_from * sizes[0] * sizes[1] {
                strong.push((j as u32, coupling / sizes[1].sqrt()));
            }
        }
        start.push(strong.len() as u32);
    }
    let near = |i: usize| &strong[start[i] as usize..start[i + 1] as usize];
    let mut aggregate_of = vec![NONE; n];
    let mut count = 0u32;
    for i in 0..n {
        let is_free = |j: usize| aggregate_of[j] == NONE;
        if is_free(i) && near(i).iter().all(|&(j, _)| is_free(j as usize)) {
            aggregate_of[i] = count;
            near(i).iter().for_each(|&(j, _)| aggregate_of[j as usize] = count);
            count += 1;
        }
    }
    // assign each remaining node to the aggregate of its most strongly coupled neighbour; only neighbours that got an
    // aggregate in the first pass count
    let before = aggregate_of.clone();
    for i in (0..n).filter(|&i| before[i] == NONE) {
        let joined = near(i)
            .iter()
            .filter(|(j, _)| before[*j as usize] != NONE)
            .max_by(|p, q| p.1.total_cmp(&q.1).then(q.0.cmp(&p.0)));
        if let Some(&(j, _)) = joined {
            aggregate_of[i] = before[j as usize];
        }
    }
    for i in 0..n {
        if aggregate_of[i] == NONE {
            aggregate_of[i] = count;
            for &(j, _) in near(i) {
                if aggregate_of[j as usize] == NONE {
                    aggregate_of[j as usize] = count;
                }
            }
            count += 1;
        }
    }
    (aggregate_of, count as usize)
}

/// Near null space (rigid-body modes) on the nodes of one level: the value of each mode at each node.
pub(super) type Modes<const R: usize> = Vec<[[f64; MODES]; R]>;

/// Returns the tentative prolongation T and the values of the modes on the aggregates.
///
/// The columns of T on one aggregate are orthonormal and span the near null space on the nodes of the aggregate.
pub(super) fn tentative<const R: usize>(
    aggregate_of: &[u32],
    count: usize,
    modes: &Modes<R>,
) -> (BlockCsr<f64, R, MODES>, Modes<MODES>) {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
    aggregate_of.iter().enumerate().for_each(|(node, &a)| members[a as usize].push(node as u32));
    let mut block = modes.clone();
    let mut coarse = vec![[[0.0; MODES]; MODES]; count];
    for (nodes, coarse) in members.iter().zip(&mut coarse) {
        let dot = |block: &Modes<R>, p: usize, q: usize| -> f64 {
            nodes
                .iter()
                .map(|&n| block[n as usize].iter().map(|row| row[p] * row[q]).sum::<f64>())
                .sum()
        };
        for k in 0..MODES {
            let whole = dot(&block, k, k).sqrt();
            // after one pass of Gram–Schmidt, rounding errors leave the columns not quite orthogonal; after two passes,
            // the columns are orthogonal
            for _ in 0..2 {
                for l in 0..k {
                    let share = dot(&block, l, k);
                    coarse[l][k] += share;
                    for &n in nodes {
                        block[n as usize].iter_mut().for_each(|row| row[k] -= share * row[l]);
                    }
                }
            }
            let rest = dot(&block, k, k).sqrt();
            // set a mode to zero if it depends linearly on the previous modes, as on an aggregate of few nodes or of
            // constrained nodes
            let scale = if rest > 1e-6 * whole { 1.0 / rest } else { 0.0 };
            coarse[k][k] = if scale > 0.0 { rest } else { 0.0 };
            for &n in nodes {
                block[n as usize].iter_mut().for_each(|row| row[k] *= scale);
            }
        }
    }
    let start = (0..=aggregate_of.len() as u32).collect();
    (BlockCsr { columns: count, start, column: aggregate_of.to_vec(), block }, coarse)
}
