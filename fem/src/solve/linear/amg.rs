//! Smoothed-aggregation multigrid for the displacement, one V-cycle in single precision.
//!
//! Reference: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511.

use nalgebra::{DMatrix, DVector, Dyn};

use super::aggregation::{MODES, Modes, aggregates, tentative};
use super::block_csr::{BlockCsr, inverse};
use super::chebyshev::Chebyshev;

/// Unknowns of the coarsest level, which is solved directly.
const COARSEST: usize = 900;
const MOST_LEVELS: usize = 12;
/// Degree of the smoother, before and after the coarse correction.
pub(super) const DEGREE: usize = 3;

/// One level and the way to the next coarser one.
#[derive(Debug)]
pub(super) struct Level<const R: usize> {
    pub(super) smoother: Chebyshev<R>,
    pub(super) prolong: BlockCsr<f32, R, MODES>,
    pub(super) restrict: BlockCsr<f32, MODES, R>,
}

/// The hierarchy.
#[derive(Debug)]
pub(super) struct Amg {
    pub(super) fine: Level<3>,
    pub(super) coarse: Vec<Level<MODES>>,
    pub(super) last: nalgebra::Cholesky<f64, Dyn>,
}

impl Amg {
    /// The hierarchy of a symmetric positive definite matrix on nodes at `points`; constrained values
    /// have rows and columns of the unit matrix.
    pub(super) fn new(
        matrix: &BlockCsr<f64, 3, 3>,
        points: &[[f64; 3]],
        free: &[[bool; 4]],
    ) -> Self {
        let (fine, mut next, mut modes) = coarsen(matrix, &rigid_body_modes(points, free));
        let mut coarse = Vec::new();
        while MODES * next.rows() > COARSEST && coarse.len() < MOST_LEVELS {
            let (level, below, below_modes) = coarsen(&next, &modes);
            if 10 * below.rows() > 9 * next.rows() {
                break;
            }
            coarse.push(level);
            (next, modes) = (below, below_modes);
        }
        Self { fine, coarse, last: factorise(&next) }
    }

    /// x ≈ A⁻¹ b.
    pub(super) fn cycle(&self, b: &[[f32; 3]], x: &mut [[f32; 3]]) {
        self.fine.cycle(b, x, |b, x| self.below(0, b, x));
    }

    fn below(&self, level: usize, b: &[[f32; MODES]], x: &mut [[f32; MODES]]) {
        match self.coarse.get(level) {
            Some(this) => this.cycle(b, x, |b, x| self.below(level + 1, b, x)),
            None => {
                let values = b.as_flattened().iter().map(|&v| f64::from(v));
                let right = DVector::from_iterator(MODES * b.len(), values);
                let solution = self.last.solve(&right);
                x.as_flattened_mut()
                    .iter_mut()
                    .zip(solution.iter())
                    .for_each(|(x, &s)| *x = s as f32);
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
        let coarse = self.restrict.rows();
        x.fill([0.0; R]);
        let mut residual = b.to_vec();
        self.smoother.smooth(DEGREE, &mut residual, x);
        residual.copy_from_slice(b);
        self.smoother.subtract(x, &mut residual);
        let (mut right, mut correction) = (vec![[0.0; MODES]; coarse], vec![[0.0; MODES]; coarse]);
        self.restrict.apply(&residual, &mut right, |y, a| *y = a);
        below(&right, &mut correction);
        self.prolong.apply(&correction, x, |x, a| (0..R).for_each(|i| x[i] += a[i]));
        residual.copy_from_slice(b);
        self.smoother.subtract(x, &mut residual);
        self.smoother.smooth(DEGREE, &mut residual, x);
    }
}

/// One level, the matrix of the next and its near null space.
fn coarsen<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    modes: &Modes<R>,
) -> (Level<R>, BlockCsr<f64, MODES, MODES>, Modes<MODES>) {
    let (of, count) = aggregates(matrix);
    let (plain, coarse_modes) = tentative(&of, count, modes);
    let smoother = Chebyshev::new(matrix);
    // P = (I − ω D⁻¹ A) T
    let omega = 4.0 / (3.0 * smoother.largest);
    let mut prolong = matrix.multiply(&plain);
    for row in 0..matrix.rows() {
        let scaling = matrix.diagonal(row).map_or([[0.0; R]; R], inverse);
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
    let restrict = prolong.transpose();
    let mut coarse = restrict.multiply(&matrix.multiply(&prolong));
    for row in 0..coarse.rows() {
        let range = coarse.start[row] as usize..coarse.start[row + 1] as usize;
        for place in range {
            if coarse.column[place] as usize == row {
                // a mode that was left out
                for k in 0..MODES {
                    if coarse.block[place][k][k] == 0.0 {
                        coarse.block[place][k][k] = 1.0;
                    }
                }
            }
        }
    }
    let level = Level { smoother, prolong: prolong.narrow(), restrict: restrict.narrow() };
    (level, coarse, coarse_modes)
}

/// Three translations and three rotations, zero in constrained values.
fn rigid_body_modes(points: &[[f64; 3]], free: &[[bool; 4]]) -> Modes<3> {
    let count = points.len().max(1) as f64;
    let centre = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / count);
    points
        .iter()
        .zip(free)
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

/// The dense factor of the coarsest matrix; shifted until it is positive definite.
fn factorise(matrix: &BlockCsr<f64, MODES, MODES>) -> nalgebra::Cholesky<f64, Dyn> {
    let n = MODES * matrix.rows();
    let mut dense = DMatrix::zeros(n, n);
    for row in 0..matrix.rows() {
        for (column, block) in matrix.row(row) {
            for i in 0..MODES {
                for j in 0..MODES {
                    dense[(MODES * row + i, MODES * column + j)] = block[i][j];
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
