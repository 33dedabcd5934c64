//! Aggregates of nodes and the near null space on them.
//!
//! Reference: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511.

use super::block_csr::BlockCsr;

/// Number of coarse unknowns per aggregate: one for each rigid-body mode.
pub(crate) const MODES: usize = 6;
/// Threshold of strong coupling between nodes of the mesh: i and j are coupled strongly if ‖A_ij‖² > `STRONG`² ‖A_ii‖
/// ‖A_jj‖.
const STRONG: f64 = 0.08;
/// Threshold of strong coupling between aggregates, on coarser levels. An aggregate couples with about fifty others,
/// most of them more weakly than nodes do. With the threshold of the nodes, the next aggregates would have only four
/// members, and the coarser levels would fill up and cost more than the finest one, the more so the larger the mesh;
/// the number of iterations is the same.
const STRONG_BELOW: f64 = 0.02;
const NONE: u32 = u32::MAX;

/// Returns the aggregate of each node, and the number of aggregates. `diagonal` contains the diagonal blocks of the
/// nodes of this rank; the matrix may have further nodes, which belong to other ranks.
pub(super) fn aggregates<const R: usize>(
    a: &BlockCsr<f64, R, R>,
    diagonal: &[[[f64; R]; R]],
) -> (Vec<u32>, usize) {
    let size = |b: &[[f64; R]; R]| b.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let n = diagonal.len();
    let strong_from = if R == MODES { STRONG_BELOW } else { STRONG };
    let own: Vec<f64> = diagonal.iter().map(size).collect();
    let mut start = vec![0u32];
    let mut strong: Vec<(u32, f64)> = Vec::new();
    for i in 0..n {
        for (j, block) in a.row(i).filter(|(j, _)| *j != i && *j < n) {
            let coupling = size(block);
            if coupling * coupling > strong_from * strong_from * own[i] * own[j] {
                strong.push((j as u32, coupling / own[j].sqrt()));
            }
        }
        start.push(strong.len() as u32);
    }
    let near = |i: usize| &strong[start[i] as usize..start[i + 1] as usize];
    let mut of = vec![NONE; n];
    let mut count = 0u32;
    for i in 0..n {
        if of[i] == NONE && near(i).iter().all(|&(j, _)| of[j as usize] == NONE) {
            of[i] = count;
            near(i).iter().for_each(|&(j, _)| of[j as usize] = count);
            count += 1;
        }
    }
    // the remaining nodes join the aggregate of their strongest neighbour; only aggregates of the first pass count
    let before = of.clone();
    for i in (0..n).filter(|&i| before[i] == NONE) {
        let joined = near(i)
            .iter()
            .filter(|(j, _)| before[*j as usize] != NONE)
            .max_by(|p, q| p.1.total_cmp(&q.1).then(q.0.cmp(&p.0)));
        if let Some(&(j, _)) = joined {
            of[i] = before[j as usize];
        }
    }
    for i in 0..n {
        if of[i] == NONE {
            of[i] = count;
            for &(j, _) in near(i) {
                if of[j as usize] == NONE {
                    of[j as usize] = count;
                }
            }
            count += 1;
        }
    }
    (of, count as usize)
}

/// Near null space on the nodes of one level: the value of each mode at each node.
pub(super) type Modes<const R: usize> = Vec<[[f64; MODES]; R]>;

/// Returns the tentative prolongation, with orthonormal columns on each aggregate that span its near null space, and
/// the coarse modes.
pub(super) fn tentative<const R: usize>(
    of: &[u32],
    count: usize,
    modes: &Modes<R>,
) -> (BlockCsr<f64, R, MODES>, Modes<MODES>) {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
    of.iter().enumerate().for_each(|(node, &a)| members[a as usize].push(node as u32));
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
            // two passes of Gram–Schmidt are enough to lose no digits
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
            // a mode that depends linearly on the others (few nodes, or all constrained) gets no unknown
            let scale = if rest > 1e-6 * whole { 1.0 / rest } else { 0.0 };
            coarse[k][k] = if scale > 0.0 { rest } else { 0.0 };
            for &n in nodes {
                block[n as usize].iter_mut().for_each(|row| row[k] *= scale);
            }
        }
    }
    let start = (0..=of.len() as u32).collect();
    (BlockCsr { columns: count, start, column: of.to_vec(), block }, coarse)
}
