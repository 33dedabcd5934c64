//! What runs on few specimens leave open of the mean response.

use ppl::prelude::*;
use surrogate::{CoefficientPosterior, GroupedRuns};

/// The interval that is to hold what it promises: that of tables and warnings.
const NOMINAL: f64 = 0.9;

/// What the specimens of runs leave open, as an error that the specimens of a laboratory share.
///
/// Runs on n specimens tell the mean response of these n, not that of all. With B the covariance of how specimens deviate
/// from the response, the fit errs by B g, g = 1/n for the mean and more where the stiffness ratio is an input and not
/// the mean one ([`GroupedRuns`]). This error is the same for all specimens that are calibrated against, and no further run
/// on the same specimens makes it smaller. How these specimens themselves deviate is another matter: each has a b of its own,
/// which is part of the scatter Σ between them that their curves show, and averages out with their number.
///
/// B comes from n specimens too, with ν = n − 1 degrees of freedom, or n − 2 with the stiffness ratio: the error over its
/// estimated standard deviation is Student's t_ν and not normal. In the likelihood it is normal with the variance
/// B g (t/z)², where t and z are the quantiles that end 90 % intervals, so that these hold what they promise where this
/// error is what matters: 14.7, 3.2, 2.1, 1.5 and 1.2 times the variance for ν = 1, 2, 3, 5 and 10.
pub(super) fn of_few(specimens: &GroupedRuns) -> CoefficientPosterior {
    let freedom = specimens.between.freedom();
    specimens.between.clone().widened(widening(freedom))
}

/// (t/z)² for ν degrees of freedom.
fn widening(freedom: f64) -> f64 {
    let outside = 0.5 * (1.0 - NOMINAL);
    let student = StudentT(freedom, 0.0, 1.0).upper_quantile(outside);
    (student / Normal(0.0, 1.0).upper_quantile(outside)).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_specimens_widen_as_tables_of_student_say() {
        // t at 95 % for 1, 2, 10 degrees of freedom and the normal
        for (freedom, t) in [(1.0, 6.313752), (2.0, 2.919986), (10.0, 1.812461), (1e9, 1.644854)] {
            let expected = (t / 1.644854f64).powi(2);
            assert!((widening(freedom) / expected - 1.0).abs() < 1e-5, "{freedom}");
        }
    }
}
