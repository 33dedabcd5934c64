//! Which tests a parameter of a joint calibration belongs to.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Tests to which a parameter belongs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scope {
    /// All tests that have the parameter share it.
    Shared,
    /// The test with this name.
    Test(String),
    /// The end of a trend over all tests, such as `at 20 °C`.
    TrendEnd(String),
}

/// Path of a parameter of a joint calibration, and the tests to which it belongs. Its text is its name in the posterior:
/// the path, followed by the test or the end of the trend in parentheses.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScopedParameter {
    /// Path of the parameter in the case, the name of an input of the surrogates.
    pub path: String,
    /// Tests to which the parameter belongs.
    pub scope: Scope,
}

impl ScopedParameter {
    /// Whether the parameter belongs to the test with this name. A parameter at the end of a trend belongs to all tests.
    pub fn is_of(&self, test: &str) -> bool {
        match &self.scope {
            Scope::Shared | Scope::TrendEnd(_) => true,
            Scope::Test(name) => name == test,
        }
    }
}

impl fmt::Display for ScopedParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.scope {
            Scope::Shared => f.write_str(&self.path),
            Scope::Test(place) | Scope::TrendEnd(place) => write!(f, "{} ({place})", self.path),
        }
    }
}
