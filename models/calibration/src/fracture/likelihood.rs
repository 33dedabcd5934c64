//! What the quantities of specimens say of the forward model and of their scatter.

use ppl::prelude::*;

use super::specimens::{Expected, Specimens};

ppl::model! {
    /// Specimens of one microstructure, where the forward model expects `expected` and `scatter` is the
    /// factor of their covariance: the statements that all calibrations share.
    pub(super) fn of_specimens(
        specimens: &Specimens,
        expected: &Expected<Real>,
        scatter: &DynCholeskyFactor<Real>,
    ) -> () {
        // differences between specimens show their scatter alone, their mean what they share too
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
