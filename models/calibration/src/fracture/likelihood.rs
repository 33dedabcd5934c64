//! Likelihood of the specimens' quantities of interest.

use ppl::DomainError;
use ppl::prelude::*;

use super::specimens::{Expected, Specimens};

ppl::model! {
    /// Likelihood of specimens of one microstructure, used in all calibrations. `expected` is the response of the
    /// forward model, and `scatter` is the Cholesky factor of the covariance between specimens.
    pub(super) fn of_specimens(
        specimens: &Specimens,
        expected: &Expected<Real>,
        scatter: &DynCholeskyFactor<Real>,
    ) -> () {
        // contrasts depend on the scatter between specimens only; totals also depend on the errors that all specimens
        // share. The condition is necessary because a loop without data would be reported as an observation without
        // data
        if !specimens.known.contrasts.is_empty() {
            if specimens.known_inputs() == 0 {
                for contrast in &specimens.known.contrasts {
                    contrast ~ MvNormalCholesky(specimens.no_contrast::<Real>(), scatter);
                }
            } else {
                let pairs = specimens.known.contrasts.iter().zip(&expected.contrasts);
                for (contrast, between) in pairs {
                    contrast ~ MvNormalCholesky(between, scatter);
                }
            }
        }
        if !specimens.unknown.contrasts.is_empty() {
            let of_unknown = specimens.factor_of_unknown(expected, scatter)?;
            for unknown in &specimens.unknown.contrasts {
                unknown ~ MvNormalCholesky(specimens.no_contrast::<Real>(), &of_unknown);
            }
        }
        let of_totals = specimens.factor_of_totals(expected, scatter)?;
        specimens.totals ~ MvNormalCholesky(specimens.mean_of_totals(expected), &of_totals);
    }
}

/// Log density of the specimens of one test, equal to the sum of the statements of `of_specimens`. A joint model of
/// tests with different numbers of quantities adds this log density as one number, because statements in a loop need
/// values of one size.
///
/// # Errors
/// If a covariance is not positive definite.
pub(super) fn ln_density_of<R: Scalar>(
    specimens: &Specimens,
    expected: &Expected<R>,
    scatter: &DynCholeskyFactor<R>,
) -> Result<R, DomainError> {
    let ln_density = |x: &Vec<f64>, mean: Vec<R>, factor: &DynCholeskyFactor<R>| -> R {
        let x: Vec<R> = x.iter().map(|&x| R::from(x)).collect();
        MvNormalCholesky(mean, factor.clone()).ln_density(&x)
    };
    let mut sum = R::from(0.0);
    for (k, contrast) in specimens.known.contrasts.iter().enumerate() {
        // the expected contrasts are zero, and not computed, if all inputs of the forward model are parameters
        let between = match specimens.known_inputs() {
            0 => specimens.no_contrast(),
            _ => expected.contrasts[k].clone(),
        };
        sum += ln_density(contrast, between, scatter);
    }
    let of_unknown = specimens.factor_of_unknown(expected, scatter)?;
    for unknown in &specimens.unknown.contrasts {
        sum += ln_density(unknown, specimens.no_contrast(), &of_unknown);
    }
    let of_totals = specimens.factor_of_totals(expected, scatter)?;
    let totals = ln_density(&specimens.totals, specimens.mean_of_totals(expected), &of_totals);
    Ok(sum + totals)
}
