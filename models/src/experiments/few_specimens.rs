//! Error of the mean response that is estimated from few specimens.

use ppl::prelude::*;
use surrogate::{CoefficientPosterior, GroupedRuns};

/// Probability of the intervals in tables and warnings. The widened error is chosen for correct coverage at this
/// probability.
const NOMINAL: f64 = 0.9;

/// Returns the error of the mean response that arises because the runs use only n specimens. This error is
/// common to all specimens of a laboratory.
///
/// Runs on n specimens determine the mean response of these n specimens, not the mean response of all possible
/// specimens. Let B be the covariance of the deviations of single specimens from the mean response. The error of the
/// fit then has the covariance B g. The factor g is 1/n; it is larger if the stiffness ratio is an input and its value
/// differs from the mean ratio ([`GroupedRuns`]). The error is the same for all specimens used in the calibration, and
/// more runs on the same n specimens do not reduce it. The deviations of the calibrated specimens themselves are
/// separate: each specimen has its own deviation, which is part of the scatter Σ of the measured curves and averages
/// out with the number of specimens.
///
/// B is estimated from n specimens too, with ν = n − 1 degrees of freedom, or n − 2 if the stiffness ratio is an input.
/// The error divided by its estimated standard deviation therefore has Student's t distribution with ν degrees of
/// freedom. The likelihood approximates this distribution by a normal distribution with covariance B g (t/z)², where t
/// and z are the quantiles that bound 90 % intervals of Student's t and the normal distribution. Thus 90 % intervals
/// have the correct coverage if this error dominates. The factor (t/z)² is 14.7, 3.2, 2.1, 1.5 and 1.2 for ν = 1, 2, 3,
/// 5 and 10.
pub(crate) fn of_few(specimens: &GroupedRuns) -> CoefficientPosterior {
    let freedom = specimens.between.freedom();
    specimens.between.clone().widened(widening(freedom))
}

/// The factor (t/z)² for ν degrees of freedom.
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
        // t at 95 % for 1, 2 and 10 degrees of freedom, and for the normal distribution
        for (freedom, t) in [(1.0, 6.313752), (2.0, 2.919986), (10.0, 1.812461), (1e9, 1.644854)] {
            let expected = (t / 1.644854f64).powi(2);
            assert!((widening(freedom) / expected - 1.0).abs() < 1e-5, "{freedom}");
        }
    }
}
