//! The normal approximation at one iterate of L-BFGS.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::Rng;
use rand_distr::StandardNormal;

/// Steps that the inverse Hessian is built from.
const MEMORY: usize = 6;
/// Largest accepted curvature zᵀz/sᵀz of a step.
const STEEPEST: f64 = 1e12;

/// Steps s and differences z of the gradient of −ln p along an optimisation, with the diagonal α
/// that they imply for the inverse Hessian.
pub(super) struct History {
    steps: Vec<(DVector<f64>, DVector<f64>)>,
    alpha: DVector<f64>,
}

impl History {
    pub(super) fn new(dim: usize) -> Self {
        Self { steps: Vec::new(), alpha: DVector::repeat(dim, 1.0) }
    }

    /// Takes up a step if the curvature along it is positive and not absurd (Gilbert & Lemaréchal,
    /// Mathematical Programming 45 (1989) 407, for the diagonal).
    pub(super) fn add(&mut self, s: DVector<f64>, z: DVector<f64>) {
        let b = z.dot(&s);
        let steep = z.norm_squared();
        if !(b > 0.0 && steep.is_finite() && steep <= STEEPEST * b) {
            return;
        }
        let a: f64 = z.iter().zip(&self.alpha).map(|(z, alpha)| z * z * alpha).sum();
        let c: f64 = s.iter().zip(&self.alpha).map(|(s, alpha)| s * s / alpha).sum();
        let renewed = self.alpha.zip_zip_map(&s, &z, |alpha, s, z| {
            1.0 / (a / (b * alpha) + z * z / b - a * s * s / (b * c * alpha * alpha))
        });
        if renewed.iter().all(|alpha| alpha.is_finite() && *alpha > 0.0) {
            self.alpha = renewed;
        }
        if self.steps.len() == MEMORY {
            self.steps.remove(0);
        }
        self.steps.push((s, z));
    }

    /// `β` and `γ` of the inverse Hessian `diag(α) + β γ βᵀ` (Byrd, Nocedal & Schnabel, Mathematical
    /// Programming 63 (1994) 129, theorem 2.2).
    fn compact(&self) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (d, j) = (self.alpha.len(), self.steps.len());
        let s = DMatrix::from_fn(d, j, |i, k| self.steps[k].0[i]);
        let z = DMatrix::from_fn(d, j, |i, k| self.steps[k].1[i]);
        let scaled = DMatrix::from_fn(d, j, |i, k| self.alpha[i] * z[(i, k)]);
        let upper = s.tr_mul(&z).upper_triangle();
        let mut inner = z.tr_mul(&scaled);
        for k in 0..j {
            inner[(k, k)] += upper[(k, k)];
        }
        let inverse = upper.solve_upper_triangular(&DMatrix::identity(j, j))?;
        let mut beta = DMatrix::zeros(d, 2 * j);
        beta.columns_mut(0, j).copy_from(&scaled);
        beta.columns_mut(j, j).copy_from(&s);
        let mut gamma = DMatrix::zeros(2 * j, 2 * j);
        gamma.view_mut((0, j), (j, j)).copy_from(&-&inverse);
        gamma.view_mut((j, 0), (j, j)).copy_from(&-inverse.transpose());
        let corner = inverse.tr_mul(&(inner * &inverse));
        gamma.view_mut((j, j), (j, j)).copy_from(&corner);
        Some((beta, gamma))
    }
}

/// Normal(μ, Σ) with `Σ = A (I + Q (L Lᵀ − I) Qᵀ) A`, A = diag(√α).
#[derive(Clone, Debug)]
pub(super) struct Approximation {
    pub(super) mean: DVector<f64>,
    root_alpha: DVector<f64>,
    /// Orthonormal columns.
    q: DMatrix<f64>,
    l: DMatrix<f64>,
    log_determinant: f64,
}

impl Approximation {
    /// At the point `theta` with score `g`; `None` where rounding leaves no positive matrix.
    pub(super) fn new(theta: &DVector<f64>, g: &DVector<f64>, history: &History) -> Option<Self> {
        let root_alpha = history.alpha.map(f64::sqrt);
        let (mut beta, gamma) = history.compact()?;
        for (mut row, root) in beta.row_iter_mut().zip(&root_alpha) {
            row /= *root;
        }
        let (q, l) = if beta.ncols() == 0 {
            (DMatrix::zeros(theta.len(), 0), DMatrix::zeros(0, 0))
        } else {
            let (q, r) = beta.qr().unpack();
            let mut inner = &r * gamma * r.transpose();
            inner = (&inner + inner.transpose()) * 0.5;
            inner += DMatrix::identity(r.nrows(), r.nrows());
            (q, Cholesky::new(inner)?.l())
        };
        let logs = |values: &mut dyn Iterator<Item = f64>| values.map(f64::ln).sum::<f64>();
        let log_determinant =
            2.0 * (logs(&mut root_alpha.iter().copied()) + logs(&mut l.diagonal().iter().copied()));
        let mut fit = Self { mean: theta.clone(), root_alpha, q, l, log_determinant };
        let newton = fit.covariance_times(g);
        fit.mean += newton;
        let finite = fit.mean.iter().all(|m| m.is_finite()) && fit.log_determinant.is_finite();
        finite.then_some(fit)
    }

    fn covariance_times(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut scaled = x.component_mul(&self.root_alpha);
        let inside = self.q.tr_mul(&scaled);
        let stretched = &self.l * self.l.tr_mul(&inside) - inside;
        scaled += &self.q * stretched;
        scaled.component_mul(&self.root_alpha)
    }

    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let d = self.mean.len();
        let columns: Vec<DVector<f64>> = (0..d)
            .map(|i| {
                self.covariance_times(&DVector::from_fn(d, |k, _| f64::from(u8::from(k == i))))
            })
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// Log density at `y`.
    pub(super) fn log_density(&self, y: &[f64]) -> f64 {
        let mut x = DVector::from_column_slice(y) - &self.mean;
        x.component_div_assign(&self.root_alpha);
        let mut inside = self.q.tr_mul(&x);
        let outside = x.norm_squared() - inside.norm_squared();
        // the factor's diagonal is positive, so that the solve cannot fail
        self.l.solve_lower_triangular_unchecked_mut(&mut inside);
        let squares = outside + inside.norm_squared();
        -0.5 * (self.log_determinant + squares + y.len() as f64 * TAU.ln())
    }

    /// A draw and its log density.
    pub(super) fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> (Vec<f64>, f64) {
        let mut u = DVector::from_fn(self.mean.len(), |_, _| rng.sample(StandardNormal));
        let squares = u.norm_squared();
        let inside = self.q.tr_mul(&u);
        u += &self.q * (&self.l * &inside - inside);
        let draw = &self.mean + u.component_mul(&self.root_alpha);
        let d = self.mean.len() as f64;
        (draw.as_slice().to_vec(), -0.5 * (self.log_determinant + squares + d * TAU.ln()))
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn some_history(dim: usize) -> History {
        let mut history = History::new(dim);
        for k in 0..3 {
            let s = DVector::from_fn(dim, |i, _| ((3 * i + 2 * k) as f64).sin());
            let z = DVector::from_fn(dim, |i, _| (1.0 + i as f64) * s[i]);
            history.add(s, z);
        }
        history
    }

    /// The compact form against the recursion of BFGS,
    /// `H ← (I − s zᵀ/η) H (I − z sᵀ/η) + s sᵀ/η`, from the same diagonal.
    #[test]
    fn the_covariance_is_the_bfgs_matrix() {
        for dim in [3, 9] {
            let history = some_history(dim);
            let mut h = DMatrix::from_diagonal(&history.alpha);
            for (s, z) in &history.steps {
                let eta = s.dot(z);
                let left = DMatrix::identity(dim, dim) - s * z.transpose() / eta;
                h = &left * h * left.transpose() + s * s.transpose() / eta;
            }
            let zero = DVector::zeros(dim);
            let fit = Approximation::new(&zero, &zero, &history).expect("positive definite");
            assert_relative_eq!(fit.covariance(), h, max_relative = 1e-9, epsilon = 1e-12);
        }
    }

    /// Draws have the covariance and the log density that they are said to have.
    #[test]
    fn draws_have_their_density() {
        let zero = DVector::zeros(5);
        let fit = Approximation::new(&zero, &zero, &some_history(5)).expect("positive definite");
        let covariance = fit.covariance();
        let cholesky = covariance.clone().cholesky().expect("positive definite");
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        const N: usize = 20_000;
        let mut scatter = DMatrix::zeros(5, 5);
        for _ in 0..N {
            let (draw, log_density) = fit.draw(&mut rng);
            let draw = DVector::from_vec(draw);
            let exact = -0.5
                * (draw.dot(&cholesky.solve(&draw)) + cholesky.determinant().ln() + 5.0 * TAU.ln());
            assert_relative_eq!(log_density, exact, max_relative = 1e-9);
            assert_relative_eq!(fit.log_density(draw.as_slice()), exact, max_relative = 1e-9);
            scatter += &draw * draw.transpose() / N as f64;
        }
        for i in 0..5 {
            for j in 0..5 {
                let (vi, vj, c) = (covariance[(i, i)], covariance[(j, j)], covariance[(i, j)]);
                let error = ((vi * vj + c * c) / N as f64).sqrt();
                assert!((scatter[(i, j)] - c).abs() < 4.5 * error, "{i} {j}");
            }
        }
    }

    #[test]
    fn steps_without_curvature_are_left_out() {
        let mut history = History::new(2);
        history.add(DVector::from_vec(vec![1.0, 0.0]), DVector::from_vec(vec![-1.0, 0.0]));
        history.add(DVector::from_vec(vec![1e-20, 0.0]), DVector::from_vec(vec![1.0, 0.0]));
        assert!(history.steps.is_empty());
    }
}
