//! `calibration.between_tests`: relation between the values of a parameter in several tests.

use serde::{Deserialize, Serialize};

/// Relation between the values of a parameter in several tests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BetweenTestsCase {
    /// All tests have the same value.
    Shared,
    /// Each test has a separate value.
    Own,
    /// The value varies between tests about a common centre. The number is the scale in % of the prior of the standard
    /// deviation between tests.
    VariesPercent(f64),
}
