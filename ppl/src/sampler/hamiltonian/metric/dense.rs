//! Dense mass matrices.

use nalgebra::{Cholesky, DMatrix, Dyn};

use crate::sampler::hamiltonian::metric::Diagonal;
use crate::sampler::hamiltonian::metric::sample::Centred;

/// Dense inverse mass matrix `M⁻¹ = Σ`, a full covariance matrix.
#[derive(Clone, Debug)]
pub(crate) struct Dense {
    /// Σ. Row-major and column-major storage are the same, because Σ is symmetric.
    matrix: Vec<f64>,
    cholesky: Cholesky<f64, Dyn>,
    /// Rows of the Cholesky factor, with reciprocals on the diagonal.
    rows: Vec<f64>,
}

/// Strength of the shrinkage of correlations, as a number of draws: with n draws, each correlation is multiplied by
/// n/(n + `SHRINKAGE`).
const SHRINKAGE: f64 = 1.0;

impl Dense {
    /// Creates the dense matrix Σ = `matrix`; `None` if `matrix` is not positive definite.
    pub(crate) fn new(matrix: Vec<f64>, dim: usize) -> Option<Self> {
        let cholesky = Cholesky::new(DMatrix::from_column_slice(dim, dim, &matrix))?;
        let mut factor = cholesky.l();
        let finite = factor.diagonal().iter().all(|l| l.is_finite());
        factor.set_diagonal(&factor.diagonal().map(f64::recip));
        let rows = factor.transpose().as_slice().to_vec();
        finite.then_some(Self { matrix, cholesky, rows })
    }

    /// Fits the dense matrix with the smallest Fisher divergence: the geometric mean of cov(x) and cov(g)⁻¹, for
    /// draws x and scores g (gradients of the log density) in units of `diagonal`. The correlations of both
    /// covariance matrices are shrunk towards zero.
    ///
    /// `None` if one coordinate is constant over the sample.
    pub(crate) fn fitted(sample: &Centred, diagonal: &Diagonal) -> Option<Self> {
        let scaled = sample.scaled(diagonal.sd());
        let n = sample.len() as f64;
        let covariance = |x: &DMatrix<f64>| {
            let full = x * x.transpose() / sample.degrees_of_freedom();
            let mut shrunk = &full * (n / (n + SHRINKAGE));
            shrunk.set_diagonal(&full.diagonal());
            shrunk
        };
        let mut mean = geometric_mean(&covariance(&scaled.draws), covariance(&scaled.scores))?;
        let sd = diagonal.sd();
        for i in 0..sample.dim() {
            for j in 0..=i {
                // symmetrise, because rounding makes the geometric mean slightly asymmetric
                let value = 0.5 * (mean[(i, j)] + mean[(j, i)]) * sd[i] * sd[j];
                (mean[(i, j)], mean[(j, i)]) = (value, value);
            }
        }
        Self::new(mean.as_slice().to_vec(), sample.dim())
    }

    /// Σ, row-major.
    pub(crate) fn matrix(&self) -> &[f64] {
        &self.matrix
    }

    pub(crate) fn variances(&self) -> Vec<f64> {
        let dim = self.cholesky.l_dirty().nrows();
        self.matrix.iter().step_by(dim + 1).copied().collect()
    }

    /// Multiplies by Σ column by column, five columns at a time, so that the compiler can use SIMD registers.
    #[inline]
    pub(crate) fn apply(&self, p: &[f64], v: &mut [f64]) {
        let dim = p.len();
        let (fives, rest) = p.as_chunks::<5>();
        let (blocks, columns) = self.matrix.split_at(5 * fives.len() * dim);
        if fives.is_empty() {
            v.fill(0.0);
        }
        for (block, (columns, p)) in blocks.chunks_exact(5 * dim).zip(fives).enumerate() {
            let [a, b, c, d, e]: [&[f64]; 5] = std::array::from_fn(|k| &columns[k * dim..][..dim]);
            let sums = a.iter().zip(b).zip(c).zip(d).zip(e).map(|((((a, b), c), d), e)| {
                (a * p[0] + b * p[1]) + (c * p[2] + d * p[3]) + e * p[4]
            });
            let entries = v.iter_mut().zip(sums);
            match block {
                0 => entries.for_each(|(v, sum)| *v = sum),
                _ => entries.for_each(|(v, sum)| *v += sum),
            }
        }
        for (column, p) in columns.chunks_exact(dim).zip(rest) {
            v.iter_mut().zip(column).for_each(|(v, a)| *v += a * p);
        }
    }

    /// Transforms standard normals to momenta, `p = L⁻ᵀ z`. L is read row by row, so that the inner loop has no
    /// running sum.
    pub(crate) fn colour(&self, p: &mut [f64]) {
        let dim = p.len();
        for i in (0..dim).rev() {
            let (before, rest) = p.split_at_mut(i);
            let row = &self.rows[i * dim..][..=i];
            rest[0] *= row[i];
            let p_i = rest[0];
            before.iter_mut().zip(row).for_each(|(p, l)| *p -= l * p_i);
        }
    }

    /// Residual `Lᵀg + L⁻¹x`, whose mean square is the Fisher divergence, for centred draws x and scores g (gradients
    /// of the log density).
    pub(crate) fn residual(&self, sample: &Centred) -> DMatrix<f64> {
        let l = self.cholesky.l();
        let mut residual = sample.draws.clone();
        // the diagonal of the Cholesky factor is positive, so that the solve cannot fail
        l.solve_lower_triangular_unchecked_mut(&mut residual);
        residual.gemm_tr(1.0, &l, &sample.scores, 1.0);
        residual
    }
}

/// Symmetric solution Σ of `Σ B Σ = A`, the geometric mean of A and B⁻¹. With `B = L Lᵀ`, `Σ = L⁻ᵀ (Lᵀ A L)^½ L⁻¹`.
///
/// `None` if B is not positive definite or an entry is not finite.
pub(crate) fn geometric_mean(a: &DMatrix<f64>, b: DMatrix<f64>) -> Option<DMatrix<f64>> {
    if a.iter().chain(b.iter()).any(|x| !x.is_finite()) {
        return None;
    }
    let l = Cholesky::new(b)?.l();
    let inner = (l.transpose() * a * &l).symmetric_eigen();
    // fourth roots of the eigenvalues, so that the result is a product R Rᵀ and positive semidefinite
    let roots = inner.eigenvalues.map(|e| e.max(0.0).sqrt().sqrt());
    let mut factor = inner.eigenvectors;
    for (mut column, root) in factor.column_iter_mut().zip(&roots) {
        column *= *root;
    }
    l.tr_solve_lower_triangular_mut(&mut factor).then(|| &factor * factor.transpose())
}
