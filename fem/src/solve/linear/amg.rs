//! Smoothed-aggregation multigrid for the displacement: one V-cycle in single precision.
//!
//! With several ranks, each rank aggregates its own nodes. Everything else is as with one rank: prolongations are
//! smoothed across the ranks, and the matrices of all levels, distributed over the ranks, are those of the whole
//! body. The coarsest matrix has at least one aggregate per rank; every rank stores it as a whole and factorises it.
//!
//! Reference: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn};

use super::aggregation::{MODES, Modes, aggregates, tentative};
use super::block_csr::{BlockCsr, inverse};
use super::chebyshev::{Chebyshev, diagonal_blocks};
use super::coarse_nodes::{CoarseNodes, first_numbers};
use super::rows::{completed, with_ghosts};
use crate::parallel::Halo;

/// Largest number of unknowns of the coarsest level, which is solved directly.
const COARSEST: usize = 900;
const MOST_LEVELS: usize = 12;
/// Degree of the smoother, which is applied before and after the coarse correction.
pub(super) const DEGREE: usize = 3;

/// One level, with the transfer to the next coarser level.
#[derive(Debug)]
pub(super) struct Level<const R: usize> {
    pub(super) smoother: Chebyshev<R>,
    pub(super) prolong: BlockCsr<f32, R, MODES>,
    pub(super) restrict: BlockCsr<f32, MODES, R>,
    /// Halo of the nodes of the next coarser level.
    below: Arc<Halo>,
}

/// Multigrid hierarchy of the displacement.
#[derive(Debug)]
pub(super) struct Amg {
    pub(super) fine: Level<3>,
    pub(super) coarse: Vec<Level<MODES>>,
    pub(super) last: nalgebra::Cholesky<f64, Dyn>,
    last_nodes: CoarseNodes,
}

/// Data of a coarser level, created from the next finer level.
struct Coarser {
    matrix: BlockCsr<f64, MODES, MODES>,
    modes: Modes<MODES>,
    nodes: CoarseNodes,
}

impl Amg {
    /// Creates the hierarchy of a symmetric positive definite matrix on nodes at `points`. Constrained values must
    /// have unit rows and columns. Each rank passes its part of the matrix.
    pub(super) fn new(
        matrix: &BlockCsr<f64, 3, 3>,
        points: &[[f64; 3]],
        free: &[[bool; 4]],
        halo: &Arc<Halo>,
    ) -> Self {
        let (fine, mut next) = coarsen(matrix, &rigid_body_modes(points, free, halo), halo);
        let mut coarse = Vec::new();
        while MODES * next.nodes.all() > COARSEST && coarse.len() < MOST_LEVELS {
            let (level, below) = coarsen(&next.matrix, &next.modes, &next.nodes.halo);
            if 10 * below.nodes.all() > 9 * next.nodes.all() {
                break;
            }
            coarse.push(level);
            next = below;
        }
        Self { fine, coarse, last: factorise(&next), last_nodes: next.nodes }
    }

    /// x ≈ A⁻¹ b.
    pub(super) fn cycle(&self, b: &[[f32; 3]], x: &mut [[f32; 3]]) {
        self.fine.cycle(b, x, |b, x| self.below(0, b, x));
    }

    fn below(&self, level: usize, b: &[[f32; MODES]], x: &mut [[f32; MODES]]) {
        match self.coarse.get(level) {
            Some(this) => this.cycle(b, x, |b, x| self.below(level + 1, b, x)),
            None => {
                let own: Vec<f32> = self.last_nodes.halo.own_of(b).flatten().copied().collect();
                let all = self.last_nodes.halo.ranks().gather(&own).into_iter().flatten();
                let right = DVector::from_iterator(self.last.l_dirty().nrows(), all.map(f64::from));
                let solution = self.last.solve(&right);
                for (x, number) in x.iter_mut().zip(self.last_nodes.numbers()) {
                    *x = std::array::from_fn(|k| solution[MODES * number as usize + k] as f32);
                }
            }
        }
    }
}

impl<const R: usize> Level<R> {
    fn cycle(
        &self,
        b: &[[f32; R]],
        x: &mut [[f32; R]],
        below: impl FnOnce(&[[f32; MODES]], &mut [[f32; MODES]]),
    ) {
        let coarse = self.prolong.columns;
        x.fill([0.0; R]);
        let mut residual = b.to_vec();
        self.smoother.smooth(DEGREE, &mut residual, x);
        residual.copy_from_slice(b);
        self.smoother.subtract(x, &mut residual);
        let (mut right, mut correction) = (vec![[0.0; MODES]; coarse], vec![[0.0; MODES]; coarse]);
        self.restrict.apply(&residual, &mut right, |y, a| *y = a);
        self.below.complete(&mut right);
        below(&right, &mut correction);
        self.prolong.apply(&correction, x, |x, a| (0..R).for_each(|i| x[i] += a[i]));
        residual.copy_from_slice(b);
        self.smoother.subtract(x, &mut residual);
        self.smoother.smooth(DEGREE, &mut residual, x);
    }
}

/// Creates one level, and the data of the next coarser one. `modes` are those of the nodes that belong to this rank.
fn coarsen<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    modes: &Modes<R>,
    halo: &Arc<Halo>,
) -> (Level<R>, Coarser) {
    let (ranks, own) = (halo.ranks(), modes.len());
    let diagonal = diagonal_blocks(matrix, halo);
    let (mut of, count) = aggregates(matrix, &diagonal[..own]);
    let (mut plain, coarse_modes) = tentative(&of, count, modes);
    let first = first_numbers(ranks, count);
    let offset = first[ranks.rank()] as u32;
    of.iter_mut().chain(&mut plain.column).for_each(|aggregate| *aggregate += offset);
    let smoother = Chebyshev::new(matrix, halo);
    // P = (I − ω D⁻¹ A) T
    let omega = 4.0 / (3.0 * smoother.largest);
    let mut prolong = product(matrix, &plain, &first, halo);
    for row in 0..own {
        let scaling = inverse(&diagonal[row]);
        for place in prolong.start[row] as usize..prolong.start[row + 1] as usize {
            let block = prolong.block[place];
            let own = prolong.column[place] == of[row];
            for i in 0..R {
                for k in 0..MODES {
                    let smoothed: f64 = (0..R).map(|j| scaling[i][j] * block[j][k]).sum();
                    let tentative = if own { plain.block[row][i][k] } else { 0.0 };
                    prolong.block[place][i][k] = tentative - omega * smoothed;
                }
            }
        }
    }
    let prolong = with_ghosts(prolong, halo);
    let nodes = CoarseNodes::new(ranks, first, &prolong);
    let prolong = nodes.localise(prolong);
    let transposed = prolong.transpose();
    let mut coarse = transposed.multiply(&matrix.multiply(&prolong));
    let whole = diagonal_blocks(&coarse, &nodes.halo);
    for row in 0..count {
        let range = coarse.start[row] as usize..coarse.start[row + 1] as usize;
        for place in range {
            if coarse.column[place] as usize == row {
                // a mode that was dropped because it depends on the others: unit diagonal
                for k in (0..MODES).filter(|&k| whole[row][k][k] == 0.0) {
                    coarse.block[place][k][k] = 1.0;
                }
            }
        }
    }
    // each node is restricted by the rank that owns it
    let restrict = match ranks.is_alone() {
        true => transposed.narrow(),
        false => prolong.first_rows(own).transpose().narrow(),
    };
    let below = Arc::clone(&nodes.halo);
    let level = Level { smoother, prolong: prolong.narrow(), restrict, below };
    (level, Coarser { matrix: coarse, modes: coarse_modes, nodes })
}

/// Returns the rows of A T that belong to this rank, from the rows of T. Column numbers count over all ranks.
fn product<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    own: &BlockCsr<f64, R, MODES>,
    first: &[usize],
    halo: &Halo,
) -> BlockCsr<f64, R, MODES> {
    if halo.ranks().is_alone() {
        return matrix.multiply(own);
    }
    let all = with_ghosts(own.clone(), halo);
    let nodes = CoarseNodes::new(halo.ranks(), first.to_vec(), &all);
    let mut partial = matrix.multiply(&nodes.localise(all));
    let numbers = nodes.numbers();
    partial.column.iter_mut().for_each(|column| *column = numbers[*column as usize]);
    completed(&partial, halo)
}

/// Returns three translations and three rotations for the nodes that belong to this rank, zero in constrained values.
fn rigid_body_modes(points: &[[f64; 3]], free: &[[bool; 4]], halo: &Halo) -> Modes<3> {
    let sum = |k: usize| halo.own_of(points).map(|p| p[k]).sum::<f64>();
    let mut sums = [sum(0), sum(1), sum(2), halo.own_of(points).count() as f64];
    halo.ranks().sum(&mut sums);
    let centre = [0, 1, 2].map(|k| sums[k] / sums[3].max(1.0));
    halo.own_of(points)
        .zip(halo.own_of(free))
        .map(|(p, free)| {
            let [x, y, z] = [0, 1, 2].map(|k| p[k] - centre[k]);
            let mut rows = [
                [1.0, 0.0, 0.0, 0.0, z, -y],
                [0.0, 1.0, 0.0, -z, 0.0, x],
                [0.0, 0.0, 1.0, y, -x, 0.0],
            ];
            for i in 0..3 {
                if !free[i] {
                    rows[i] = [0.0; MODES];
                }
            }
            rows
        })
        .collect()
}

/// Returns the dense factor of the coarsest matrix, gathered from all ranks. The diagonal is shifted until the matrix
/// is positive definite.
fn factorise(coarsest: &Coarser) -> nalgebra::Cholesky<f64, Dyn> {
    let Coarser { matrix, nodes, .. } = coarsest;
    let n = MODES * nodes.all();
    let numbers = nodes.numbers();
    let (mut places, mut blocks) = (Vec::<u32>::new(), Vec::<f64>::new());
    for row in 0..matrix.rows() {
        for (column, block) in matrix.row(row) {
            places.extend([numbers[row], numbers[column]]);
            blocks.extend(block.as_flattened());
        }
    }
    let mut dense = DMatrix::<f64>::zeros(n, n);
    let ranks = nodes.halo.ranks();
    for (places, blocks) in ranks.gather(&places).iter().zip(ranks.gather(&blocks)) {
        for (place, block) in places.chunks_exact(2).zip(blocks.chunks_exact(MODES * MODES)) {
            let [row, column] = [0, 1].map(|k| MODES * place[k] as usize);
            for i in 0..MODES {
                for j in 0..MODES {
                    dense[(row + i, column + j)] += block[MODES * i + j];
                }
            }
        }
    }
    let scale = (0..n).map(|i| dense[(i, i)].abs()).fold(f64::MIN_POSITIVE, f64::max);
    let mut shift = 1e-12 * scale;
    loop {
        match dense.clone().cholesky() {
            Some(factor) => return factor,
            None if shift > 1e3 * scale => return DMatrix::identity(n, n).cholesky().expect("one"),
            None => {
                (0..n).for_each(|i| dense[(i, i)] += shift);
                shift *= 10.0;
            }
        }
    }
}
