//! Likelihood of the specimens' quantities of interest.

use ppl::DomainError;
use ppl::prelude::*;

use super::specimens::{Expected, Kind, Specimens};

ppl::model! {
    /// Likelihood of specimens of one microstructure, used in all calibrations. `expected` is the response of the
    /// forward model, and `scatter` is the Cholesky factor of the covariance between specimens.
    pub(super) fn of_specimens(
        specimens: &Specimens,
        expected: &Expected<Real>,
        scatter: &DynCholeskyFactor<Real>,
    ) -> () {
        if !specimens.is_complete() {
            // specimens with different recorded quantities have densities of different sizes
            factor(ln_density_of(specimens, expected, scatter)?);
        } else {
            // contrasts depend on the scatter between specimens only; totals also depend on the errors that all specimens
            // share. The condition is necessary because a loop without data would be reported as an observation without
            // data
            let between_known = specimens.contrasts_of(Kind::Known);
            if !between_known.is_empty() {
                if specimens.known_inputs() == 0 {
                    for contrast in between_known {
                        contrast ~ MvNormalCholesky(specimens.no_contrast::<Real>(), scatter);
                    }
                } else {
                    let pairs = between_known.into_iter().zip(&expected.contrasts);
                    for (contrast, between) in pairs {
                        contrast ~ MvNormalCholesky(between, scatter);
                    }
                }
            }
            let between_unknown = specimens.contrasts_of(Kind::Unknown);
            if !between_unknown.is_empty() {
                let of_unknown = specimens.factor_of_unknown(expected, scatter)?;
                for unknown in between_unknown {
                    unknown ~ MvNormalCholesky(specimens.no_contrast::<Real>(), &of_unknown);
                }
            }
            let of_totals = specimens.factor_of_totals(expected, scatter)?;
            specimens.totals ~ MvNormalCholesky(specimens.mean_of_totals(expected), &of_totals);
        }
    }
}

/// Log density of the recorded quantities of the specimens of one test. If every quantity was recorded, it is the sum of
/// the statements of `of_specimens`. A joint model of tests with different numbers of quantities adds this log density as
/// one number, because statements in a loop need values of one size.
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
    let mut between_known = expected.contrasts.iter();
    for group in specimens.groups.iter().filter(|group| !group.contrasts.is_empty()) {
        let factor = specimens.factor_of_specimen(group, expected, scatter)?;
        for contrast in &group.contrasts {
            // expected contrasts are zero between specimens with unknown inputs, or if all inputs of the forward model
            // are parameters
            let between = match group.kind {
                Kind::Known => between_known.next().cloned(),
                Kind::Unknown => None,
            };
            let between = between.unwrap_or_else(|| vec![R::from(0.0); contrast.len()]);
            sum += ln_density(contrast, between, &factor);
        }
    }
    let of_totals = specimens.factor_of_totals(expected, scatter)?;
    let totals = ln_density(&specimens.totals, specimens.mean_of_totals(expected), &of_totals);
    Ok(sum + totals)
}
