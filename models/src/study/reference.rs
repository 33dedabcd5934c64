//! Published results that a case of a study is compared with.

use serde::Deserialize;

use crate::case::ByParameter;

/// Published results of a case.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reference {
    /// Joint mode.
    pub map: ByParameter<f64>,
    /// Differences of the simulation at the mode to the experimental means in per cent, in the order of
    /// the quantities of interest.
    pub percent_error: Vec<f64>,
}
