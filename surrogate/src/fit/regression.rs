//! Least squares fits to nested sets of columns from one QR factorisation.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::{householder, qr::no_pivoting::factor, triangular_inverse};
use faer::{Conj, Mat, Par};

use crate::fit::leave_out::{Prefix, row_of};

/// QR factorisation Ψ = Q R of a basis matrix Ψ with thin Q, and the targets Y of all outputs.
///
/// The first k columns of Q and the leading k × k block of R factorise the first k columns of Ψ.
/// Coefficients, leverages and errors of every prefix of the columns therefore need no further factorisation.
pub(crate) struct NestedLeastSquares {
    q: Mat<f64>,
    r_inverse: Mat<f64>,
    /// Products Qᵀ Y of the columns of Q with the targets Y, terms × outputs.
    projections: Mat<f64>,
    y: Mat<f64>,
    runs: usize,
}

impl NestedLeastSquares {
    /// Factorises Ψ (rows × terms), which must not have more columns than rows. The first `runs` rows are the
    /// values; the rows of the derivatives follow, run after run.
    ///
    /// If a column depends linearly on earlier columns to working precision, this column and all later columns are
    /// ignored. [`Self::rank`] is the number of remaining columns.
    pub(crate) fn new(psi: Mat<f64>, y: Mat<f64>, runs: usize) -> Self {
        let (q, r) = thin_qr(psi);
        let largest = (0..r.ncols()).map(|j| r[(j, j)].abs()).fold(0.0, f64::max);
        let floor = largest * f64::EPSILON * q.nrows() as f64;
        let rank = (0..r.ncols()).find(|&j| r[(j, j)].abs() <= floor).unwrap_or(r.ncols());
        let mut r_inverse = Mat::zeros(rank, rank);
        triangular_inverse::invert_upper_triangular(
            r_inverse.as_mut(),
            r.get(..rank, ..rank),
            Par::Seq,
        );
        let projections = Mat::from_fn(rank, y.ncols(), |j, m| {
            (0..q.nrows()).map(|i| q[(i, j)] * y[(i, m)]).sum()
        });
        Self { q, r_inverse, projections, y, runs }
    }

    pub(crate) fn rank(&self) -> usize {
        self.r_inverse.ncols()
    }

    /// Returns the fits with the first `sizes[0]`, `sizes[1]`, … columns. The sizes must increase and must not exceed
    /// the rank.
    pub(crate) fn sweep(&self, sizes: &[usize]) -> Vec<Prefix> {
        let (rows, runs) = (self.q.nrows(), self.runs);
        let block = rows / runs;
        let (mut residuals, mut trace) = (self.y.clone(), 0.0);
        let mut hat = vec![0.0; runs * block * block];
        let mut done = 0;
        let mut prefixes = Vec::new();
        for &terms in sizes {
            for j in done..terms {
                for i in 0..rows {
                    for m in 0..residuals.ncols() {
                        residuals[(i, m)] -= self.q[(i, j)] * self.projections[(j, m)];
                    }
                }
                for (run, hat) in hat.chunks_mut(block * block).enumerate() {
                    let q = |row_in_block| self.q[(row_of(runs, block, run, row_in_block), j)];
                    for (a, row) in hat.chunks_mut(block).enumerate() {
                        row.iter_mut().enumerate().for_each(|(b, h)| *h += q(a) * q(b));
                    }
                }
                trace += (0..=j).map(|i| self.r_inverse[(i, j)].powi(2)).sum::<f64>();
            }
            done = terms;
            let (residuals, hat) = (residuals.clone(), hat.clone());
            prefixes.push(Prefix { terms, runs, residuals, hat, trace });
        }
        prefixes
    }

    /// Jackknife covariance (outputs × outputs) of the fit with the first `terms` columns, averaged over the box. This
    /// covariance is Σ_b Δ_bᵀ Δ_b, where Δ_b = R⁻¹ Q_bᵀ (I − H_bb)⁻¹ r_b is the change of the coefficients when run b
    /// is left out. Ψ = Q R is the factorisation of the basis matrix. Q_b, r_b and H_bb are the rows of Q, the
    /// residuals and the block of the hat matrix of run b. The estimate is valid for any correlation of the errors
    /// within a run.
    pub(crate) fn jackknife(&self, prefix: &Prefix, left_out: &Mat<f64>) -> Vec<Vec<f64>> {
        let (runs, outputs) = (self.runs, left_out.ncols());
        let block = self.q.nrows() / runs;
        let mut total = Mat::zeros(outputs, outputs);
        for run in 0..runs {
            let moved = Mat::from_fn(prefix.terms, outputs, |j, m| {
                let at = |row_in_block| row_of(runs, block, run, row_in_block);
                (0..block)
                    .map(|row_in_block| {
                        self.q[(at(row_in_block), j)] * left_out[(at(row_in_block), m)]
                    })
                    .sum::<f64>()
            });
            let change = self.r_inverse.get(..prefix.terms, ..prefix.terms) * moved;
            total += change.transpose() * &change;
        }
        (0..outputs).map(|m| (0..outputs).map(|k| total[(m, k)]).collect()).collect()
    }

    /// Returns the coefficients (terms × outputs) of the fit with the first `terms` columns.
    pub(crate) fn coefficients(&self, terms: usize) -> Mat<f64> {
        Mat::from_fn(terms, self.projections.ncols(), |i, m| {
            (i..terms).map(|j| self.r_inverse[(i, j)] * self.projections[(j, m)]).sum()
        })
    }

    /// Returns the leading `terms` × `terms` block of R⁻¹.
    pub(crate) fn r_inverse(&self, terms: usize) -> Mat<f64> {
        self.r_inverse.get(..terms, ..terms).to_owned()
    }
}

/// Computes the thin QR factorisation (Q, R). The computation is sequential, because the result must not depend on
/// the number of threads.
fn thin_qr(mut a: Mat<f64>) -> (Mat<f64>, Mat<f64>) {
    let (n, p) = a.shape();
    let block = factor::recommended_block_size::<f64>(n, p);
    let mut coefficients = Mat::zeros(block, p);
    let scratch = factor::qr_in_place_scratch::<f64>(n, p, block, Par::Seq, Default::default());
    factor::qr_in_place(
        a.as_mut(),
        coefficients.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    );
    let r = Mat::from_fn(p, p, |i, j| if i <= j { a[(i, j)] } else { 0.0 });
    let mut q = Mat::identity(n, p);
    let scratch = householder::apply_block_householder_sequence_on_the_left_in_place_scratch::<f64>(
        n, block, p,
    );
    householder::apply_block_householder_sequence_on_the_left_in_place_with_conj(
        a.as_ref(),
        coefficients.as_ref(),
        Conj::No,
        q.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
    );
    (q, r)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Returns a deterministic basis matrix and right-hand sides for tests.
    fn example(n: usize, p: usize) -> (Mat<f64>, Mat<f64>) {
        let psi = Mat::from_fn(n, p, |i, j| ((i * i + 3) as f64 * 0.37 + j as f64 * 1.7).sin());
        let y = Mat::from_fn(n, 2, |i, m| ((i + 5 * m) as f64 * 0.61).cos());
        (psi, y)
    }

    #[test]
    fn every_prefix_solves_its_own_normal_equations() {
        let (psi, y) = example(30, 12);
        let fit = NestedLeastSquares::new(psi.clone(), y.clone(), psi.nrows());
        assert_eq!(fit.rank(), 2, "sin(a + j b) spans two dimensions");
        let psi =
            Mat::from_fn(30, 12, |i, j| ((i * i + 3 * j) as f64 * 0.37).sin() + f64::from(i == j));
        let fit = NestedLeastSquares::new(psi.clone(), y.clone(), psi.nrows());
        assert_eq!(fit.rank(), 12);
        for prefix in fit.sweep(&[1, 4, 12]) {
            let a = psi.get(.., ..prefix.terms);
            let c = fit.coefficients(prefix.terms);
            let residuals = &y - a * &c;
            let gradient = a.transpose() * &residuals;
            assert!(gradient.norm_max() < 1e-12);
            assert!((residuals - &prefix.residuals).norm_max() < 1e-12);
            assert_relative_eq!(
                prefix.leverages().sum::<f64>(),
                prefix.terms as f64,
                max_relative = 1e-12
            );
            let r_inverse = fit.r_inverse(prefix.terms);
            let gram = a.transpose() * a;
            let identity = gram * &r_inverse * r_inverse.transpose();
            assert!(
                (identity - Mat::<f64>::identity(prefix.terms, prefix.terms)).norm_max() < 1e-9
            );
        }
    }

    #[test]
    fn fast_leave_one_out_is_brute_force() {
        let (n, p) = (25, 6);
        let psi =
            Mat::from_fn(n, p, |i, j| ((i * i + 3 * j) as f64 * 0.37).sin() + f64::from(i == j));
        let (_, y) = example(n, p);
        let fast = NestedLeastSquares::new(psi.clone(), y.clone(), psi.nrows()).sweep(&[p])[0]
            .loo_residuals()
            .unwrap();
        for left_out in 0..n {
            let remaining = |i: usize| if i < left_out { i } else { i + 1 };
            let fit = NestedLeastSquares::new(
                Mat::from_fn(n - 1, p, |i, j| psi[(remaining(i), j)]),
                Mat::from_fn(n - 1, 2, |i, m| y[(remaining(i), m)]),
                n - 1,
            );
            let c = fit.coefficients(p);
            for m in 0..2 {
                let f: f64 = (0..p).map(|j| psi[(left_out, j)] * c[(j, m)]).sum();
                assert_relative_eq!(
                    fast[(left_out, m)],
                    y[(left_out, m)] - f,
                    epsilon = 1e-13,
                    max_relative = 1e-12
                );
            }
        }
    }

    /// Tests runs of three rows: one value and two derivatives. All values come first, then the derivatives, run
    /// after run.
    #[test]
    fn fast_leave_one_run_out_is_brute_force() {
        let (runs, block, p) = (9, 3, 11);
        let psi = Mat::from_fn(runs * block, p, |i, j| {
            ((i * i) as f64 * 0.37 + (i * j) as f64 * 0.73).sin()
        });
        let (_, y) = example(runs * block, p);
        let of_run = |run: usize| [run, runs + 2 * run, runs + 2 * run + 1];
        let whole = NestedLeastSquares::new(psi.clone(), y.clone(), runs);
        let prefix = &whole.sweep(&[p])[0];
        let fast = prefix.left_out().unwrap();
        let c = whole.coefficients(p);
        let mut changes = Mat::<f64>::zeros(2, 2);
        for left_out in 0..runs {
            let remaining: Vec<usize> =
                (0..runs * block).filter(|row| !of_run(left_out).contains(row)).collect();
            let fit = NestedLeastSquares::new(
                Mat::from_fn(remaining.len(), p, |i, j| psi[(remaining[i], j)]),
                Mat::from_fn(remaining.len(), 2, |i, m| y[(remaining[i], m)]),
                runs - 1,
            );
            let rest = fit.coefficients(p);
            for row in of_run(left_out) {
                for m in 0..2 {
                    let f: f64 = (0..p).map(|j| psi[(row, j)] * rest[(j, m)]).sum();
                    let expected = y[(row, m)] - f;
                    assert_relative_eq!(
                        fast[(row, m)],
                        expected,
                        epsilon = 1e-12,
                        max_relative = 1e-12
                    );
                }
            }
            changes += (&c - &rest).transpose() * (&c - &rest);
        }
        let jackknife = whole.jackknife(prefix, &fast);
        for (m, row) in jackknife.iter().enumerate() {
            for (k, change) in row.iter().enumerate() {
                assert_relative_eq!(*change, changes[(m, k)], max_relative = 1e-11);
            }
        }
        assert_relative_eq!(prefix.leverages().sum::<f64>() + prefix.freedom(), runs as f64);
        let all: f64 = (0..block).map(|row_in_block| prefix.leverage_at(row_in_block)).sum();
        assert_relative_eq!(all, p as f64, max_relative = 1e-12);
    }

    #[test]
    fn a_row_that_alone_determines_a_coefficient_has_no_leave_one_out() {
        let psi = Mat::from_fn(10, 2, |i, j| if j == 0 { 1.0 } else { f64::from(i == 3) });
        let y = Mat::from_fn(10, 1, |i, _| i as f64);
        let fit = NestedLeastSquares::new(psi, y, 10);
        let prefixes = fit.sweep(&[1, 2]);
        assert!(prefixes[0].loo_residuals().is_some());
        assert!(prefixes[1].loo_residuals().is_none());
    }
}
