//! The covariance matrix of a Gaussian process at given inputs, and its Cholesky factor.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::kernel::{Kernel, Point};
use crate::scalar::Scalar;
use crate::special::HALF_LN_2PI;

/// Variance on the diagonal, against that of the process: what rounding costs the smallest
/// eigenvalues of a smooth kernel is far below it.
const JITTER: f64 = 1e-10;

/// K = a² (Φ + jitter) + σ² at some inputs; the noise is on the first `noisy` of them.
pub(super) struct Covariance<'a, P, K, R> {
    pub(super) inputs: [&'a [P]; 2],
    pub(super) kernel: &'a K,
    pub(super) noise: R,
    pub(super) noisy: usize,
}

impl<P: Point, K: Kernel<R>, R: Scalar> Covariance<'_, P, K, R> {
    pub(super) fn size(&self) -> usize {
        self.inputs[0].len() + self.inputs[1].len()
    }

    fn point(&self, i: usize) -> &[f64] {
        let n = self.inputs[0].len();
        if i < n { self.inputs[0][i].coordinates() } else { self.inputs[1][i - n].coordinates() }
    }

    /// φ, dφ/ds and the parts of s that go with each length scale.
    fn correlation(&self, i: usize, j: usize, lengths: &[f64], parts: &mut [f64]) -> (f64, f64) {
        parts.fill(0.0);
        for (d, (x, y)) in self.point(i).iter().zip(self.point(j)).enumerate() {
            let k = if lengths.len() == 1 { 0 } else { d };
            parts[k] += ((x - y) / lengths[k]).powi(2);
        }
        self.kernel.profile(parts.iter().sum())
    }

    fn lengths(&self) -> Vec<f64> {
        (0..self.kernel.lengths()).map(|k| self.kernel.length(k).value()).collect()
    }

    /// ln N(x; mean, K) as one operation. With α = K⁻¹ (x − mean): partials −α in x, α in the
    /// mean, and ½ tr[(α αᵀ − K⁻¹) ∂K/∂θ] in amplitude, length scales and noise.
    pub(super) fn ln_density(&self, x: impl Fn(usize) -> R, mean: impl Fn(usize) -> R) -> R {
        let n = self.size();
        let lengths = self.lengths();
        let mut parts = vec![0.0; lengths.len()];
        let (amplitude, noise) = (self.kernel.amplitude(), self.noise);
        let (a, sd) = (amplitude.value(), noise.value());
        let mut matrix = DMatrix::zeros(n, n);
        for j in 0..n {
            for i in j + 1..n {
                matrix[(i, j)] = a * a * self.correlation(i, j, &lengths, &mut parts).0;
            }
            let own = if j < self.noisy { sd * sd } else { 0.0 };
            matrix[(j, j)] = a * a * (1.0 + JITTER) + own;
        }
        let Some(cholesky) = Cholesky::new(matrix) else { return R::from(f64::NAN) };
        let residual = DVector::from_fn(n, |i, _| x(i).value() - mean(i).value());
        let weights = cholesky.solve(&residual);
        let ln_diagonal: f64 = (0..n).map(|i| cholesky.l_dirty()[(i, i)].ln()).sum();
        let value = -0.5 * residual.dot(&weights) - ln_diagonal - n as f64 * HALF_LN_2PI;
        let ends = (0..n).flat_map(|i| [(x(i), -weights[i]), (mean(i), weights[i])]);
        let constant = amplitude.is_constant()
            && noise.is_constant()
            && (0..lengths.len()).all(|k| self.kernel.length(k).is_constant());
        if constant {
            return R::fuse_iter(value, ends);
        }
        let inverse = cholesky.inverse();
        let weight = |i: usize, j: usize| weights[i] * weights[j] - inverse[(i, j)];
        let (mut in_amplitude, mut in_noise) = (0.0, 0.0);
        let mut in_lengths = vec![0.0; lengths.len()];
        for j in 0..n {
            in_amplitude += weight(j, j) * a * (1.0 + JITTER);
            if j < self.noisy {
                in_noise += weight(j, j) * sd;
            }
            for i in j + 1..n {
                let (phi, slope) = self.correlation(i, j, &lengths, &mut parts);
                let weight = weight(i, j);
                in_amplitude += weight * 2.0 * a * phi;
                for (k, total) in in_lengths.iter_mut().enumerate() {
                    *total -= weight * a * a * slope * 2.0 * parts[k] / lengths[k];
                }
            }
        }
        let in_lengths =
            in_lengths.into_iter().enumerate().map(|(k, g)| (self.kernel.length(k), g));
        R::fuse_iter(
            value,
            ends.chain([(amplitude, in_amplitude), (noise, in_noise)]).chain(in_lengths),
        )
    }

    /// The factor L of K/a² = Φ + jitter + q, q = (σ/a)², with its derivatives along the length
    /// scales in `along` and, in the end, along q if `in_noise`; `None` if it is not positive
    /// definite.
    pub(super) fn root(&self, along: &[usize], in_noise: bool) -> Option<Root> {
        let lengths = self.lengths();
        let mut parts = vec![0.0; lengths.len()];
        let q = (self.noise.value() / self.kernel.amplitude().value()).powi(2);
        Root::new(self.size(), along.len() + usize::from(in_noise), |i, j, tangents| {
            if i == j {
                tangents.fill(0.0);
                let noisy = i < self.noisy;
                if let (true, true, Some(last)) = (in_noise, noisy, tangents.last_mut()) {
                    *last = 1.0;
                }
                return 1.0 + JITTER + if noisy { q } else { 0.0 };
            }
            let (phi, slope) = self.correlation(i, j, &lengths, &mut parts);
            for (tangent, &k) in tangents.iter_mut().zip(along) {
                *tangent = -2.0 * slope * parts[k] / lengths[k];
            }
            if let (true, Some(last)) = (in_noise, tangents.last_mut()) {
                *last = 0.0;
            }
            phi
        })
    }
}

/// A Cholesky factor, row by row, with its derivatives along some directions.
pub(super) struct Root {
    n: usize,
    lower: Vec<f64>,
    tangents: Vec<Vec<f64>>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Root {
    /// Factor of the matrix whose entries on and below the diagonal, and their derivatives, come
    /// from `entry`: the Cholesky recurrence, differentiated line by line.
    fn new(
        n: usize,
        directions: usize,
        mut entry: impl FnMut(usize, usize, &mut [f64]) -> f64,
    ) -> Option<Self> {
        let mut lower = vec![0.0; n * n];
        let mut tangents = vec![vec![0.0; n * n]; directions];
        let mut moved = vec![0.0; directions];
        for i in 0..n {
            for j in 0..=i {
                let (row, other) = (i * n..i * n + j, j * n..j * n + j);
                let rest =
                    entry(i, j, &mut moved) - dot(&lower[row.clone()], &lower[other.clone()]);
                let value = if i == j { rest.sqrt() } else { rest / lower[j * n + j] };
                // a negative or vanishing pivot, or none
                if i == j && (value.is_nan() || value <= 0.0) {
                    return None;
                }
                lower[i * n + j] = value;
                for (tangent, moved) in tangents.iter_mut().zip(&moved) {
                    let rest = moved
                        - dot(&tangent[row.clone()], &lower[other.clone()])
                        - dot(&lower[row.clone()], &tangent[other.clone()]);
                    tangent[i * n + j] = if i == j {
                        0.5 * rest / value
                    } else {
                        (rest - value * tangent[j * n + j]) / lower[j * n + j]
                    };
                }
            }
        }
        Some(Self { n, lower, tangents })
    }

    /// Row `i` up to the diagonal.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.lower[i * self.n..=i * self.n + i]
    }

    /// (L z)ᵢ.
    pub(super) fn times(&self, i: usize, z: &[f64]) -> f64 {
        dot(self.row(i), z)
    }

    /// The derivative of (L z)ᵢ along direction `k`.
    pub(super) fn moved(&self, k: usize, i: usize, z: &[f64]) -> f64 {
        dot(&self.tangents[k][i * self.n..=i * self.n + i], z)
    }

    /// Σ ln Lᵢᵢ.
    pub(super) fn ln_determinant(&self) -> f64 {
        (0..self.n).map(|i| self.lower[i * self.n + i].ln()).sum()
    }

    /// Its derivative along direction `k`.
    pub(super) fn ln_determinant_moved(&self, k: usize) -> f64 {
        let diagonal = (0..self.n).map(|i| i * self.n + i);
        diagonal.map(|d| self.tangents[k][d] / self.lower[d]).sum()
    }

    /// The z with L z = b in the first `b.len()` rows.
    pub(super) fn solve(&self, b: impl ExactSizeIterator<Item = f64>) -> Vec<f64> {
        let mut z = Vec::with_capacity(self.n);
        for (i, b) in b.enumerate() {
            let inner = dot(&self.row(i)[..i], &z);
            z.push((b - inner) / self.row(i)[i]);
        }
        z
    }
}
