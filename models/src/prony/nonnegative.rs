//! Least squares with unknowns that are not negative.

use nalgebra::{DMatrix, DVector};

/// Largest gradient of an unknown at zero, relative to the largest gradient at the start, that counts as zero.
const TOLERANCE: f64 = 1e-12;

/// Returns the x ≥ 0 that minimises |A x − b|, by the active-set method.
///
/// Reference: Lawson & Hanson, Solving Least Squares Problems (1974), chapter 23.
pub(super) fn nonnegative(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let count = a.ncols();
    let mut x = DVector::zeros(count);
    let mut is_free = vec![false; count];
    let limit = TOLERANCE * (a.transpose() * b).amax();
    for _ in 0..3 * count {
        let gradient = a.transpose() * (b - a * &x);
        let bound = (0..count).filter(|&k| !is_free[k]);
        let Some(next) = bound.max_by(|&i, &j| gradient[i].total_cmp(&gradient[j])) else { break };
        if gradient[next] <= limit {
            break;
        }
        is_free[next] = true;
        loop {
            let free: Vec<usize> = (0..count).filter(|&k| is_free[k]).collect();
            let Ok(solution) = a.select_columns(&free).svd(true, true).solve(b, 1e-14) else {
                return x;
            };
            if solution.iter().all(|value| *value > 0.0) {
                x.fill(0.0);
                free.iter().zip(solution.iter()).for_each(|(&k, value)| x[k] = *value);
                break;
            }
            // move towards the solution until the first unknown becomes zero
            let mut share: f64 = 1.0;
            for (&k, value) in free.iter().zip(solution.iter()).filter(|(_, value)| **value <= 0.0)
            {
                share = share.min(x[k] / (x[k] - value));
            }
            for (&k, value) in free.iter().zip(solution.iter()) {
                x[k] += share * (value - x[k]);
                if *value <= 0.0 && x[k] <= 1e-14 * x.amax() {
                    (x[k], is_free[k]) = (0.0, false);
                }
            }
            if free.iter().all(|&k| is_free[k]) {
                // set the unknown to zero explicitly: rounding errors would leave a small value
                is_free[next] = false;
                x[next] = 0.0;
                break;
            }
        }
    }
    x
}
