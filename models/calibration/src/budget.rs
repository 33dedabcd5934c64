//! Sources of the uncertainty of a calibrated parameter.

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

/// Returns the shares of the sources in the posterior variance of each parameter, `shares[parameter][source]`. The
/// shares of one parameter sum to 1; they are all zero if no quantity depends on the parameter.
///
/// The model is linearised at the posterior mean. J (`jacobian`, quantities × parameters) contains the derivatives of
/// the quantities. C_s is the covariance that source s causes in the means of the quantities, and C = Σ_s C_s is the
/// total covariance. P is the diagonal matrix of the inverse prior variances. A change y of the quantities changes the
/// estimate of the parameters by G y with the gain G = (JᵀC⁻¹J + P)⁻¹ JᵀC⁻¹. Source s contributes the diagonal of G C_s
/// Gᵀ to the posterior variances. Returns `None` if C is not positive definite.
pub fn shares(
    jacobian: &[Vec<f64>],
    prior_variances: &[f64],
    sources: &[DMatrix<f64>],
) -> Option<Vec<Vec<f64>>> {
    let j = matrix(jacobian);
    let total: DMatrix<f64> = sources.iter().sum();
    let precision = Cholesky::new(total)?;
    let weighted = precision.solve(&j).transpose();
    let mut information = &weighted * &j;
    for (i, variance) in prior_variances.iter().enumerate() {
        information[(i, i)] += variance.recip();
    }
    let gain = Cholesky::new(information)?.solve(&weighted);
    let variances_by_source: Vec<DMatrix<f64>> =
        sources.iter().map(|source| &gain * source * gain.transpose()).collect();
    let parameter_shares = |i: usize| {
        let sum: f64 = variances_by_source.iter().map(|variance| variance[(i, i)]).sum();
        let share = |part: f64| if sum > 0.0 { part / sum } else { 0.0 };
        variances_by_source.iter().map(|variance| share(variance[(i, i)])).collect()
    };
    Some((0..prior_variances.len()).map(parameter_shares).collect())
}

/// Returns the largest factor t ≤ 1 for which whole − t · part is positive semidefinite; 0 if `whole` is not positive
/// definite.
pub fn largest_part(whole: &DMatrix<f64>, part: &DMatrix<f64>) -> f64 {
    let Some(factor) = Cholesky::new(whole.clone()) else { return 0.0 };
    let Some(inverse) = factor.l().try_inverse() else { return 0.0 };
    let relative = &inverse * part * inverse.transpose();
    let largest = SymmetricEigen::new(relative).eigenvalues.max();
    if largest > 1.0 { largest.recip() } else { 1.0 }
}

/// Converts rows to a matrix.
pub fn matrix(rows: &[Vec<f64>]) -> DMatrix<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_quantity_shares_as_its_variances_do_and_one_of_two_is_left_alone() {
        let sources = [matrix(&[vec![3e-4]]), matrix(&[vec![1e-4]])];
        let computed = shares(&[vec![2.0]], &[1e6], &sources).unwrap();
        assert!((computed[0][0] - 0.75).abs() < 1e-12 && (computed[0][1] - 0.25).abs() < 1e-12);

        // each of two parameters is measured by one quantity, and each quantity has an error from one source only
        let diagonal = |a: f64, b: f64| matrix(&[vec![a, 0.0], vec![0.0, b]]);
        let computed = shares(
            &[vec![1.0, 0.0], vec![0.0, 5.0]],
            &[1.0, 1.0],
            &[diagonal(1e-3, 0.0), diagonal(0.0, 1e-3)],
        );
        assert_eq!(computed.unwrap(), [[1.0, 0.0], [0.0, 1.0]]);
    }

    /// Compares the shares with the variances of estimates that are computed from random errors of the quantities.
    #[test]
    fn shares_are_those_of_the_estimates_of_disturbed_quantities() {
        use rand::{Rng, SeedableRng};
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal);
        let jacobian = vec![vec![1.0, 0.3], vec![0.6, -0.4], vec![-0.2, 0.9]];
        let factors = [
            matrix(&[vec![0.03, 0.0, 0.0], vec![0.01, 0.02, 0.0], vec![0.0, 0.01, 0.04]]),
            matrix(&[vec![0.02, 0.0, 0.0], vec![-0.01, 0.01, 0.0], vec![0.02, 0.0, 0.01]]),
        ];
        let sources = factors.each_ref().map(|l| l * l.transpose());
        let computed = shares(&jacobian, &[0.5, 0.2], &sources).unwrap();
        // ridge regression of the errors, written out as normal equations
        let j = matrix(&jacobian);
        let inverse = (&sources[0] + &sources[1]).try_inverse().unwrap();
        let prior = DMatrix::from_diagonal(&nalgebra::dvector![2.0, 5.0]);
        let normal_equations = j.transpose() * &inverse * &j + prior;
        let draws = 40_000;
        let mut variances = [[0.0; 2]; 2];
        for _ in 0..draws {
            for (source, factor) in factors.iter().enumerate() {
                let error = factor * nalgebra::dvector![normal(), normal(), normal()];
                let right = j.transpose() * &inverse * error;
                let estimate = normal_equations.clone().lu().solve(&right).unwrap();
                for i in 0..2 {
                    variances[i][source] += estimate[i] * estimate[i] / f64::from(draws);
                }
            }
        }
        for i in 0..2 {
            let share = variances[i][0] / (variances[i][0] + variances[i][1]);
            // four standard errors of a share, which is computed from two sample variances
            let tolerance = 4.0 * share * (1.0 - share) * (4.0 / f64::from(draws)).sqrt();
            assert!((share - computed[i][0]).abs() < tolerance, "{share} {computed:?}");
        }
    }

    /// The posterior of a parameter on which no quantity depends is its prior, to which no source contributes.
    #[test]
    fn a_parameter_on_which_no_quantity_depends_has_no_shares() {
        let sources = [matrix(&[vec![3e-4]]), matrix(&[vec![1e-4]])];
        let computed = shares(&[vec![2.0, 0.0]], &[1e6, 1.0], &sources).unwrap();
        assert!((computed[0].iter().sum::<f64>() - 1.0).abs() < 1e-12, "{computed:?}");
        assert_eq!(computed[1], [0.0, 0.0]);
    }

    #[test]
    fn a_part_is_cut_to_what_the_whole_can_hold() {
        let whole = matrix(&[vec![4.0, 0.0], vec![0.0, 1.0]]);
        let part = matrix(&[vec![1.0, 0.0], vec![0.0, 2.0]]);
        assert!((largest_part(&whole, &part) - 0.5).abs() < 1e-12);
        assert_eq!(largest_part(&whole, &matrix(&[vec![1.0, 0.0], vec![0.0, 0.5]])), 1.0);
    }
}
