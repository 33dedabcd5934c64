//! Times of the readings of a test with a load program.

use super::finding::{Finding, Weight};
use crate::experiment::TestCurve;

/// Checks that the curve has times and that they increase, and returns the first error found.
pub(super) fn times(curve: &TestCurve) -> Option<Finding> {
    let times = &curve.time_s;
    let error = |name, value, problem: String, help| {
        Some(Finding { name, value, problem, help, weight: Weight::Error })
    };
    if times.len() != curve.displacement_mm.len() {
        return error(
            "no-time",
            f64::NAN,
            "has no column time_s, and the test has a load program".to_owned(),
            "Add the time of each reading in s: the program finds the hold and the unloading by these times.",
        );
    }
    let back = times.windows(2).find(|pair| pair[1] <= pair[0])?;
    error(
        "time",
        back[1],
        format!("has a reading at {} s after the reading at {} s", back[1], back[0]),
        "Sort its rows by time, and remove readings of equal time.",
    )
}
