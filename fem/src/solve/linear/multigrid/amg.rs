//! Smoothed-aggregation multigrid for the displacement: one V-cycle in single precision.
//!
//! With several ranks, each rank aggregates only the nodes that it owns. All other computations are the same as with
//! one rank: prolongations are smoothed across the ranks, and the sum of the matrices of all ranks on a level is the
//! matrix of the whole body. The coarsest level has at least one aggregate per rank; every rank stores and factorises
//! the whole coarsest matrix.
//!
//! Reference: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn};

use super::super::in_memory::InMemory;
use super::aggregation::{MODES, Modes, aggregates, tentative};
use super::assembled::{Assembled, diagonal_blocks};
use super::block_csr::{BlockCsr, inverse};
use super::chebyshev::Smoother;
use super::coarse_nodes::{CoarseNodes, first_numbers};
use super::cycle::{Amg, AmgLevel, Level};
use super::matrix::{Grid, Preconditioner};
use super::rows::{completed, with_ghosts};
use crate::parallel::Halo;

/// Largest number of unknowns of the coarsest level, which is solved directly.
const COARSEST: usize = 900;
/// Largest number of levels between the finest and the coarsest level.
const MOST_LEVELS: usize = 12;
/// Degree of the Chebyshev smoother, which is applied before and after the coarse correction.
const DEGREE: usize = 3;

/// Matrix of one level, with the transfer between the nodes of the level and their aggregates, the nodes of the next
/// coarser level.
#[derive(Debug)]
pub(crate) struct Aggregation<const R: usize> {
    pub(crate) matrix: Assembled<R>,
    pub(crate) prolong: BlockCsr<f32, R, MODES>,
    pub(crate) restrict: BlockCsr<f32, MODES, R>,
    /// Halo of the aggregates: which ranks share which aggregate.
    coarse: Arc<Halo>,
}

impl<const R: usize> Grid for Aggregation<R> {
    type Matrix = Assembled<R>;
    type Coarse = InMemory<f32, MODES>;

    fn matrix(&mut self) -> &mut Assembled<R> {
        &mut self.matrix
    }

    fn restrict(&mut self, r: &[[f32; R]], b: &mut [[f32; MODES]]) {
        self.restrict.apply(r, b, |b, sum| *b = sum);
        self.coarse.complete(b);
    }

    fn add_prolonged(&mut self, c: &[[f32; MODES]], x: &mut [[f32; R]]) {
        self.prolong.apply(c, x, |x, sum| (0..R).for_each(|i| x[i] += sum[i]));
    }
}

/// Dense factor of the matrix of the coarsest level. Every rank stores the whole factor.
#[derive(Debug)]
pub(crate) struct DenseFactor {
    pub(crate) factor: nalgebra::Cholesky<f64, Dyn>,
    nodes: CoarseNodes,
}

impl Preconditioner for DenseFactor {
    type Space = InMemory<f32, MODES>;

    fn apply(&mut self, b: &mut [[f32; MODES]], x: &mut [[f32; MODES]]) {
        let owned: Vec<f32> = self.nodes.halo.own_of(b).flatten().copied().collect();
        let all = self.nodes.halo.ranks().gather(&owned).into_iter().flatten();
        let right = DVector::from_iterator(self.factor.l_dirty().nrows(), all.map(f64::from));
        let solution = self.factor.solve(&right);
        for (x, number) in x.iter_mut().zip(self.nodes.global_ids()) {
            *x = std::array::from_fn(|k| solution[MODES * number as usize + k] as f32);
        }
    }
}

/// Multigrid hierarchy in the memory of this process.
pub(crate) type AmgInMemory = Amg<Aggregation<3>, Aggregation<MODES>, DenseFactor>;

/// Data of a coarser level, created from the next finer level.
struct Coarser {
    matrix: BlockCsr<f64, MODES, MODES>,
    modes: Modes<MODES>,
    nodes: CoarseNodes,
}

/// Creates the multigrid hierarchy of a symmetric positive definite matrix on nodes at `positions`, mm. Constrained values
/// must have unit rows and columns. With several ranks, `matrix` is this rank's contribution to the matrix.
pub(super) fn amg(
    matrix: &BlockCsr<f64, 3, 3>,
    positions: &[[f64; 3]],
    free: &[[bool; 4]],
    halo: &Arc<Halo>,
) -> AmgInMemory {
    let (fine, mut next) = coarsen(matrix, &rigid_body_modes(positions, free, halo), halo);
    let mut coarse = Vec::new();
    while MODES * next.nodes.all() > COARSEST && coarse.len() < MOST_LEVELS {
        let (level, below) = coarsen(&next.matrix, &next.modes, &next.nodes.halo);
        if 10 * below.nodes.all() > 9 * next.nodes.all() {
            break;
        }
        coarse.push(level);
        next = below;
    }
    Amg { fine, coarse, last: DenseFactor { factor: factorise(&next), nodes: next.nodes } }
}

/// Creates one level, and the data from which the next coarser level is created. `modes` has one entry per node that
/// this rank owns.
fn coarsen<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    modes: &Modes<R>,
    halo: &Arc<Halo>,
) -> (AmgLevel<Aggregation<R>>, Coarser) {
    let (ranks, owned) = (halo.ranks(), modes.len());
    let diagonal = diagonal_blocks(matrix, halo);
    let (mut aggregate_of, count) = aggregates(matrix, &diagonal[..owned]);
    let (mut plain, coarse_modes) = tentative(&aggregate_of, count, modes);
    let first = first_numbers(ranks, count);
    let offset = first[ranks.rank()] as u32;
    aggregate_of.iter_mut().chain(&mut plain.column).for_each(|aggregate| *aggregate += offset);
    let mut assembled = Assembled::new(matrix, &diagonal, halo);
    let (vectors, residual) = (InMemory::new(halo), vec![[0.0; R]; matrix.rows()]);
    let smoother = Smoother::measured(&vectors, &mut assembled, DEGREE, &residual);
    // smoothed prolongation P = (I − ω D⁻¹ A) T from the matrix A, its diagonal blocks D and the tentative prolongation
    // T
    let omega = 4.0 / (3.0 * smoother.largest);
    let mut prolong = product(matrix, &plain, &first, halo);
    for row in 0..owned {
        let scaling = inverse(&diagonal[row]);
        for entry in prolong.start[row] as usize..prolong.start[row + 1] as usize {
            let block = prolong.block[entry];
            let is_in_aggregate = prolong.column[entry] == aggregate_of[row];
            for i in 0..R {
                for k in 0..MODES {
                    let smoothed: f64 = (0..R).map(|j| scaling[i][j] * block[j][k]).sum();
                    let tentative = if is_in_aggregate { plain.block[row][i][k] } else { 0.0 };
                    prolong.block[entry][i][k] = tentative - omega * smoothed;
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
        for entry in range {
            if coarse.column[entry] as usize == row {
                // a mode that `tentative` has set to zero gets a unit diagonal, so that the matrix is not singular
                for k in (0..MODES).filter(|&k| whole[row][k][k] == 0.0) {
                    coarse.block[entry][k][k] = 1.0;
                }
            }
        }
    }
    // only the rank that owns a node adds the node to the coarse matrix
    let restrict = match ranks.is_alone() {
        true => transposed.narrow(),
        false => prolong.first_rows(owned).transpose().narrow(),
    };
    let right = vec![[0.0; MODES]; prolong.columns];
    let level = Level::new(vectors, &InMemory::new(&nodes.halo), smoother, residual, right);
    let below = Arc::clone(&nodes.halo);
    let grid =
        Aggregation { matrix: assembled, prolong: prolong.narrow(), restrict, coarse: below };
    (AmgLevel { grid, level }, Coarser { matrix: coarse, modes: coarse_modes, nodes })
}

/// Returns the rows of the product of the matrix A and the tentative prolongation T, for the nodes that this rank owns.
/// `tentative` contains the rows of T for these nodes. Column numbers are numbers of aggregates over all ranks.
fn product<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    tentative: &BlockCsr<f64, R, MODES>,
    first: &[usize],
    halo: &Halo,
) -> BlockCsr<f64, R, MODES> {
    if halo.ranks().is_alone() {
        return matrix.multiply(tentative);
    }
    let all = with_ghosts(tentative.clone(), halo);
    let nodes = CoarseNodes::new(halo.ranks(), first.to_vec(), &all);
    let mut partial = matrix.multiply(&nodes.localise(all));
    let global_ids = nodes.global_ids();
    partial.column.iter_mut().for_each(|column| *column = global_ids[*column as usize]);
    completed(&partial, halo)
}

/// Returns three translations and three rotations at the nodes that this rank owns. Constrained values of these modes
/// are zero.
fn rigid_body_modes(positions: &[[f64; 3]], free: &[[bool; 4]], halo: &Halo) -> Modes<3> {
    let sum = |k: usize| halo.own_of(positions).map(|p| p[k]).sum::<f64>();
    let mut sums = [sum(0), sum(1), sum(2), halo.own_of(positions).count() as f64];
    halo.ranks().sum(&mut sums);
    let centre = [0, 1, 2].map(|k| sums[k] / sums[3].max(1.0));
    halo.own_of(positions)
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

/// Returns the dense factor of the matrix of the coarsest level, which is gathered from all ranks. The diagonal of this
/// matrix is increased until the matrix is positive definite.
fn factorise(coarsest: &Coarser) -> nalgebra::Cholesky<f64, Dyn> {
    let Coarser { matrix, nodes, .. } = coarsest;
    let n = MODES * nodes.all();
    let global_ids = nodes.global_ids();
    let (mut positions, mut blocks) = (Vec::<u32>::new(), Vec::<f64>::new());
    for row in 0..matrix.rows() {
        for (column, block) in matrix.row(row) {
            positions.extend([global_ids[row], global_ids[column]]);
            blocks.extend(block.as_flattened());
        }
    }
    let mut dense = DMatrix::<f64>::zeros(n, n);
    let ranks = nodes.halo.ranks();
    for (positions, blocks) in ranks.gather(&positions).iter().zip(ranks.gather(&blocks)) {
        for (position, block) in positions.chunks_exact(2).zip(blocks.chunks_exact(MODES * MODES)) {
            let [row, column] = [0, 1].map(|k| MODES * position[k] as usize);
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
