//! Chebyshev smoothing with the inverse of the diagonal blocks, in single precision.
//!
//! Reference: Adams, Brezina, Hu & Tuminaro, J. Comput. Phys. 188 (2003) 593,
//! doi:10.1016/S0021-9991(03)00194-3.

use super::block_csr::{BlockCsr, inverse};

/// A matrix with what its smoother needs.
#[derive(Debug)]
pub(super) struct Chebyshev<const R: usize> {
    pub(super) matrix: BlockCsr<f32, R, R>,
    inverse: Vec<[[f32; R]; R]>,
    /// Upper bound of the eigenvalues of D⁻¹ A.
    pub(super) largest: f64,
}

/// The smoother acts on eigenvalues above this share of the largest.
pub(super) const SHARE: f64 = 0.2;
const POWER_STEPS: usize = 12;
/// The power iteration stays below the largest eigenvalue.
const MARGIN: f64 = 1.1;

impl<const R: usize> Chebyshev<R> {
    pub(super) fn new(matrix: &BlockCsr<f64, R, R>) -> Self {
        let inverse = (0..matrix.rows())
            .map(|row| {
                let block = matrix.diagonal(row).map_or([[0.0; R]; R], inverse);
                block.map(|r| r.map(|x| x as f32))
            })
            .collect();
        let mut this = Self { matrix: matrix.narrow(), inverse, largest: 1.0 };
        this.largest = MARGIN * this.power();
        this
    }

    fn power(&self) -> f64 {
        let n = self.matrix.rows();
        // any start that is not orthogonal to the rough vectors; no random numbers needed
        let mut x: Vec<[f32; R]> = (0..n)
            .map(|i| std::array::from_fn(|k| ((i * R + k) as f32 * 1.7 + 0.3).sin()))
            .collect();
        let mut y = vec![[0.0; R]; n];
        let mut largest = 1.0;
        for _ in 0..POWER_STEPS {
            self.matrix.apply(&x, &mut y, |y, ax| *y = ax);
            for (y, inverse) in y.iter_mut().zip(&self.inverse) {
                *y = times(inverse, y);
            }
            let norm = |v: &[[f32; R]]| {
                v.iter().flatten().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>().sqrt()
            };
            let (before, after) = (norm(&x), norm(&y));
            if after == 0.0 || before == 0.0 {
                break;
            }
            largest = after / before;
            let scale = (1.0 / after) as f32;
            for (x, y) in x.iter_mut().zip(&y) {
                *x = y.map(|v| scale * v);
            }
        }
        largest
    }

    /// D⁻¹ x.
    pub(super) fn scale(&self, row: usize, x: &[f32; R]) -> [f32; R] {
        times(&self.inverse[row], x)
    }

    /// Improves x towards A x = b by a polynomial of the given degree; `residual` holds b − A x,
    /// and afterwards no longer does.
    pub(super) fn smooth(
        &self,
        degree: usize,
        residual: &mut [[f32; R]],
        x: &mut [[f32; R]],
        step: &mut [[f32; R]],
    ) {
        let steps = coefficients(self.largest, degree);
        for (k, &(momentum, weight)) in steps.iter().enumerate() {
            for (row, (step, r)) in step.iter_mut().zip(residual.iter()).enumerate() {
                let scaled = self.scale(row, r);
                for i in 0..R {
                    let kept = if k == 0 { 0.0 } else { momentum * step[i] };
                    step[i] = kept + weight * scaled[i];
                }
            }
            for (x, step) in x.iter_mut().zip(step.iter()) {
                (0..R).for_each(|i| x[i] += step[i]);
            }
            if k + 1 < steps.len() {
                self.matrix.apply(step, residual, |r, a| (0..R).for_each(|i| r[i] -= a[i]));
            }
        }
    }
}

/// (momentum, weight) of each step: d ← momentum d + weight D⁻¹ r.
pub(super) fn coefficients(largest: f64, degree: usize) -> Vec<(f32, f32)> {
    let (low, high) = (SHARE * largest, largest);
    let (centre, half) = (0.5 * (high + low), 0.5 * (high - low));
    let sigma = centre / half;
    let mut rho = 1.0 / sigma;
    let mut steps = vec![(0.0, (1.0 / centre) as f32)];
    for _ in 1..degree {
        let next = 1.0 / (2.0 * sigma - rho);
        steps.push(((next * rho) as f32, (2.0 * next / half) as f32));
        rho = next;
    }
    steps
}

fn times<const R: usize>(a: &[[f32; R]; R], x: &[f32; R]) -> [f32; R] {
    std::array::from_fn(|i| (0..R).map(|j| a[i][j] * x[j]).sum())
}
