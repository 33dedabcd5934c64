//! Likelihood of the specimens' quantities of interest.

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
        // share
        for (contrast, between) in specimens.known.contrasts.iter().zip(&expected.contrasts) {
            contrast ~ MvNormalCholesky(between, scatter);
        }
        let of_unknown = specimens.factor_of_unknown(expected, scatter)?;
        for unknown in &specimens.unknown.contrasts {
            unknown ~ MvNormalCholesky(specimens.no_contrast::<Real>(), &of_unknown);
        }
        let of_totals = specimens.factor_of_totals(expected, scatter)?;
        specimens.totals ~ MvNormalCholesky(specimens.mean_of_totals(expected), &of_totals);
    }
}
