//! Published results, with which a case of a study is compared.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::case::ByParameter;

/// Published results of a case.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Reference {
    /// Published joint mode of the parameters.
    pub map: ByParameter<f64>,
    /// Published differences between the simulation at the posterior mode and the experimental means in per cent, in
    /// the order of the quantities of interest.
    pub percent_error: Vec<f64>,
}
