//! Correlations of quantities from partial correlations, so that a model can have correlation matrices of different
//! sizes in one loop.

use ppl::DomainError;
use ppl::prelude::*;

/// Shapes of the symmetric beta distributions of the partial correlations, mapped from (−1, 1) to (0, 1), for which the
/// correlation matrix of `size` quantities has the LKJ distribution with the concentration `eta`. The partial
/// correlations are the entries below the diagonal, row by row.
///
/// # Reference
/// Lewandowski, Kurowicka & Joe (2009), doi:10.1016/j.jmva.2009.04.008, section 2.4.
pub(super) fn shapes(size: usize, eta: f64) -> Vec<f64> {
    let shape = |column: usize| eta + 0.5 * (size as f64 - 2.0 - column as f64);
    (1..size).flat_map(|row| (0..row).map(shape)).collect()
}

/// Cholesky factor of the correlation matrix of `size` quantities, from its partial correlations mapped to (0, 1).
///
/// # Errors
/// If the number of partial correlations does not suit the size.
pub(super) fn factor_of<R: Scalar>(
    size: usize,
    partials: &[R],
) -> Result<DynCholeskyFactor<R>, DomainError> {
    let mut partials = partials.iter();
    let mut rows: Vec<Vec<R>> = Vec::with_capacity(size);
    for row in 0..size {
        let mut entries = vec![R::from(0.0); size];
        // product of √(1 − p²) over the partial correlations p of the preceding entries of the row
        let mut rest = R::from(1.0);
        for (entry, &unit) in entries.iter_mut().take(row).zip(partials.by_ref()) {
            let partial = unit * 2.0 - 1.0;
            *entry = rest * partial;
            // 1 − p² = 4 u (1 − u), without cancellation near the ends
            rest *= (unit * (-unit + 1.0)).sqrt() * 2.0;
        }
        entries[row] = rest;
        rows.push(entries);
    }
    DynCholeskyFactor::new(&rows)
}

/// Correlations below the diagonal, row by row, from the Cholesky factor of the correlation matrix.
pub(super) fn below_diagonal<R: Scalar>(factor: &DynCholeskyFactor<R>) -> Vec<R> {
    let correlation = factor.covariance();
    let rows = correlation.iter().enumerate();
    rows.flat_map(|(row, entries)| entries[..row].to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_correlations_are_those_of_the_matrix() {
        // correlations 0.3, −0.2 and 0.5: the partial correlation of the second and third quantity given the first is
        // (0.5 − 0.3 (−0.2))/√((1 − 0.3²)(1 − 0.2²))
        let partial = (0.5 + 0.06) / ((1.0 - 0.09f64) * (1.0 - 0.04)).sqrt();
        let units = [0.3, -0.2, partial].map(|p| 0.5 * (p + 1.0));
        let factor = factor_of(3, &units).unwrap();
        for (found, expected) in below_diagonal(&factor).iter().zip([0.3, -0.2, 0.5]) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        for row in factor.covariance().iter().enumerate().map(|(i, row)| row[i]) {
            assert!((row - 1.0).abs() < 1e-14, "{row}");
        }
    }

    /// Every correlation of an LKJ matrix of K quantities has the variance 1/(2η + K − 1).
    #[test]
    fn random_matrices_have_the_variance_of_the_lkj_distribution() {
        use rand::SeedableRng;
        use rand_distr::{Beta, Distribution};
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let (size, eta, draws) = (4, 3.0, 20_000);
        let shapes = shapes(size, eta);
        let mut squares = vec![[0.0; 2]; shapes.len()];
        for _ in 0..draws {
            let units: Vec<f64> =
                shapes.iter().map(|&b| Beta::new(b, b).unwrap().sample(&mut rng)).collect();
            let found = below_diagonal(&factor_of(size, &units).unwrap());
            for (sums, r) in squares.iter_mut().zip(found) {
                sums[0] += r * r;
                sums[1] += r.powi(4);
            }
        }
        let n = f64::from(draws);
        for [square, fourth] in squares {
            let (variance, expected) = (square / n, (2.0 * eta + size as f64 - 1.0).recip());
            let error = ((fourth / n - variance * variance) / n).sqrt();
            assert!((variance - expected).abs() < 4.0 * error, "{variance} {expected} ± {error}");
        }
    }
}
