//! Inverse mass matrices with a diagonal and a low-rank correction, for many coordinates.

use nalgebra::{Cholesky, DMatrix};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::sampler::draws::report::InverseMassMatrix;
use crate::sampler::hamiltonian::dot::dot;
use crate::sampler::hamiltonian::metric::Diagonal;
use crate::sampler::hamiltonian::metric::dense::geometric_mean;
use crate::sampler::hamiltonian::metric::sample::Centred;

/// Low-rank inverse mass matrix `M⁻¹ = D (I + U (Λ − I) Uᵀ) D` with D = diag(σ) and orthonormal columns of U.
#[derive(Clone, Debug)]
pub(crate) struct LowRank {
    diagonal: Diagonal,
    /// Columns of U, concatenated.
    vectors: Vec<f64>,
    /// Diagonal of Λ.
    values: Vec<f64>,
}

/// Number of leading directions of the draws, and number of leading directions of the scores (gradients of the log
/// density).
const DIRECTIONS: usize = 16;
/// Number of subspace iterations.
const ROUNDS: usize = 2;
/// Smallest ratio of the smallest to the largest diagonal entry of the Cholesky factor for which the factor is accurate
/// enough to orthonormalise the columns.
const SMALLEST_PIVOT_RATIO: f64 = 1e-6;
/// Weight of the identity matrix in a regularised covariance matrix, as a number of draws: the sum of n · covariance
/// and `SHRINKAGE` · identity is divided by n + `SHRINKAGE`.
const SHRINKAGE: f64 = 1.0;
/// Smallest factor by which a direction must increase or decrease the variance. Directions with a smaller change are
/// omitted.
const NEGLIGIBLE: f64 = 1.5;

impl LowRank {
    pub(crate) fn new(diagonal: Diagonal, vectors: Vec<f64>, values: Vec<f64>) -> Self {
        Self { diagonal, vectors, values }
    }

    /// Fits the low-rank matrix with the smallest Fisher divergence in a subspace. The subspace is spanned by the
    /// directions in which, in units of the diagonal, the draws vary most (wide directions) and the scores (gradients
    /// of the log density) vary most (narrow directions). These directions are computed with the diagonal `diagonal`.
    /// The diagonal of the result minimises the Fisher divergence of the sample projected onto the complement of the
    /// directions.
    ///
    /// `None` if a matrix is not finite.
    pub(crate) fn fitted(sample: &Centred, diagonal: &Diagonal) -> Option<Self> {
        let scaled = sample.scaled(diagonal.sd());
        let leading = Leading::new(&scaled, None)?;
        let rest = scaled.without(&leading.basis());
        let variances = diagonal.variances();
        let corrected = |i: usize| variances[i] * rest.fisher_variance(i);
        let diagonal = Diagonal::renewed(variances.to_vec(), corrected);

        let scaled = sample.scaled(diagonal.sd());
        let basis = Leading::new(&scaled, Some(&leading))?.basis();
        let transposed = basis.transpose();
        let n = sample.len() as f64;
        let covariance = |x: &DMatrix<f64>| {
            let inside = &transposed * x;
            let full = &inside * inside.transpose() / sample.degrees_of_freedom();
            (full * n + DMatrix::identity(basis.ncols(), basis.ncols()) * SHRINKAGE)
                / (n + SHRINKAGE)
        };
        let mean = geometric_mean(&covariance(&scaled.draws), covariance(&scaled.scores))?;
        let eigen = mean.symmetric_eigen();
        let (mut vectors, mut values) = (Vec::new(), Vec::new());
        for (k, &value) in eigen.eigenvalues.iter().enumerate() {
            if value > NEGLIGIBLE || value > 0.0 && value < 1.0 / NEGLIGIBLE {
                let direction = &basis * eigen.eigenvectors.column(k);
                vectors.extend_from_slice(direction.as_slice());
                values.push(value);
            }
        }
        Some(Self::new(diagonal, vectors, values))
    }

    pub(crate) fn rank(&self) -> usize {
        self.values.len()
    }

    pub(crate) fn covariance(&self) -> InverseMassMatrix {
        InverseMassMatrix::LowRank {
            variances: self.diagonal.variances().to_vec(),
            vectors: self.vectors.clone(),
            values: self.values.clone(),
        }
    }

    pub(crate) fn variances(&self) -> Vec<f64> {
        let dim = self.diagonal.variances().len();
        let mut factor = vec![1.0; dim];
        for (vector, value) in self.vectors.chunks_exact(dim).zip(&self.values) {
            factor.iter_mut().zip(vector).for_each(|(f, u)| *f += (value - 1.0) * u * u);
        }
        factor.iter().zip(self.diagonal.variances()).map(|(f, s2)| f * s2).collect()
    }

    /// Computes `x ← (I + U (f(Λ) − I) Uᵀ) x`. Since the columns of U are orthogonal, they are applied sequentially,
    /// four at a time.
    #[inline]
    fn stretch(&self, x: &mut [f64], f: impl Fn(f64) -> f64) {
        let dim = x.len();
        let (fours, rest) = self.values.as_chunks::<4>();
        let (vectors, others) = self.vectors.split_at(4 * fours.len() * dim);
        for (vectors, values) in vectors.chunks_exact(4 * dim).zip(fours) {
            let vectors: [&[f64]; 4] = std::array::from_fn(|k| &vectors[k * dim..][..dim]);
            let along = dots(x, vectors);
            let change: [f64; 4] = std::array::from_fn(|k| (f(values[k]) - 1.0) * along[k]);
            let [a, b, c, d] = vectors;
            for ((((x, a), b), c), d) in x.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *x += (change[0] * a + change[1] * b) + (change[2] * c + change[3] * d);
            }
        }
        for (vector, value) in others.chunks_exact(dim).zip(rest) {
            let change = (f(*value) - 1.0) * dot(x, vector);
            x.iter_mut().zip(vector).for_each(|(x, u)| *x += change * u);
        }
    }

    #[inline]
    pub(crate) fn apply(&self, p: &[f64], v: &mut [f64]) {
        let sd = self.diagonal.sd();
        v.iter_mut().zip(p).zip(sd).for_each(|((v, p), sd)| *v = sd * p);
        self.stretch(v, |value| value);
        v.iter_mut().zip(sd).for_each(|(v, sd)| *v *= sd);
    }

    /// Transforms standard normals to momenta.
    pub(crate) fn colour(&self, p: &mut [f64]) {
        self.stretch(p, |value| value.sqrt().recip());
        self.diagonal.colour(p);
    }

    /// Residual `Fᵀg + F⁻¹x` with `F = D (I + U (Λ^½ − I) Uᵀ)`, whose mean square is the Fisher divergence, for
    /// centred draws x and scores g (gradients of the log density).
    pub(crate) fn residual(&self, sample: &Centred) -> DMatrix<f64> {
        let mut scaled = sample.scaled(self.diagonal.sd());
        let columns = |x: &mut DMatrix<f64>, f: fn(f64) -> f64| {
            x.as_mut_slice().chunks_exact_mut(sample.dim()).for_each(|x| self.stretch(x, f));
        };
        columns(&mut scaled.draws, |value| value.sqrt().recip());
        columns(&mut scaled.scores, f64::sqrt);
        scaled.draws + scaled.scores
    }
}

/// Scalar products `xᵀu` with four vectors u, each in four partial sums.
#[inline]
fn dots(x: &[f64], u: [&[f64]; 4]) -> [f64; 4] {
    let (chunks, rest) = x.as_chunks::<4>();
    let [a, b, c, d] = u.map(|u| u.as_chunks::<4>().0);
    let mut sums = [[0.0; 4]; 4];
    for ((((x, a), b), c), d) in chunks.iter().zip(a).zip(b).zip(c).zip(d) {
        for (sums, u) in sums.iter_mut().zip([a, b, c, d]) {
            for l in 0..4 {
                sums[l] += x[l] * u[l];
            }
        }
    }
    std::array::from_fn(|k| {
        let [a, b, c, d] = sums[k];
        let u = u[k].as_chunks::<4>().1;
        let rest: f64 = rest.iter().zip(u).map(|(x, u)| x * u).sum();
        (a + b) + (c + d) + rest
    })
}

/// Directions in which the draws vary most (`wide`) and in which the scores (gradients of the log density) vary most
/// (`narrow`); each matrix has orthonormal columns.
struct Leading {
    wide: DMatrix<f64>,
    narrow: DMatrix<f64>,
}

impl Leading {
    /// Computes the directions from a random start, or from the nearby directions `near`. `None` if a number is not
    /// finite.
    fn new(sample: &Centred, near: Option<&Self>) -> Option<Self> {
        let wide = leading_directions(&sample.draws, near.map(|near| &near.wide))?;
        let narrow = leading_directions(&sample.scores, near.map(|near| &near.narrow))?;
        Some(Self { wide, narrow })
    }

    /// Orthonormal basis of the span of all directions.
    fn basis(&self) -> DMatrix<f64> {
        let (wide, narrow) = (self.wide.ncols(), self.narrow.ncols());
        let mut both = DMatrix::zeros(self.wide.nrows(), wide + narrow);
        both.columns_mut(0, wide).copy_from(&self.wide);
        both.columns_mut(wide, narrow).copy_from(&self.narrow);
        orthonormal(both)
    }
}

/// Orthonormal directions in which the columns of `x` vary most. Subspace iteration starts from a fixed random matrix;
/// if nearly correct directions `near` are given, one iteration from them is enough (Halko, Martinsson & Tropp, SIAM
/// Review 53 (2011) 217, algorithm 4.4).
fn leading_directions(x: &DMatrix<f64>, near: Option<&DMatrix<f64>>) -> Option<DMatrix<f64>> {
    if x.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let transposed = x.transpose();
    let round = |basis: &DMatrix<f64>| orthonormal(x * (&transposed * basis));
    if let Some(near) = near {
        return Some(round(near));
    }
    let count = DIRECTIONS.min(x.nrows()).min(x.ncols());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let start = DMatrix::from_fn(x.ncols(), count, |_, _| rng.sample(StandardNormal));
    Some((0..ROUNDS).fold(orthonormal(x * start), |basis, _| round(&basis)))
}

/// Orthonormal basis of the span of the columns of `x`. Two rounds of Cholesky QR are used, because they consist of
/// matrix products only; nearly dependent columns use a Householder QR decomposition instead (Yamamoto, Nakatsukasa,
/// Yanagisawa & Fukaya, ETNA 44 (2015) 306).
fn orthonormal(x: DMatrix<f64>) -> DMatrix<f64> {
    let once = |x: &DMatrix<f64>| {
        let l = Cholesky::new(x.transpose() * x)?.unpack();
        let (least, most) = (l.diagonal().min(), l.diagonal().max());
        let inverse = l.solve_lower_triangular(&DMatrix::identity(l.nrows(), l.ncols()))?;
        (least > most * SMALLEST_PIVOT_RATIO).then(|| x * inverse.transpose())
    };
    once(&x).and_then(|x| once(&x)).unwrap_or_else(|| x.qr().q())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bases_are_orthonormal_and_span_the_same() {
        for nearly in [1.0, 1e-3, 1e-9] {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
            let mut x = DMatrix::from_fn(60, 5, |_, _| rng.sample(StandardNormal));
            let close = x.column(0) + x.column(1) * nearly;
            x.set_column(2, &close);
            let basis = orthonormal(x.clone());
            let error = (basis.transpose() * &basis - DMatrix::identity(5, 5)).norm();
            assert!(error < 1e-14 * 10.0, "{nearly}: {error}");
            let outside = (&x - &basis * (basis.transpose() * &x)).norm();
            assert!(outside < 1e-13 * x.norm(), "{nearly}: {outside}");
        }
    }
}
