//! `[parameters]`: calibrated parameters with names of the user's choice, for runs that come from outside this program.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::PriorCase;
use super::target::{FreeParameter, Parameter};
use crate::prior::Prior;

/// `parameters.<name>`: a calibrated parameter whose name the user chooses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeParameterCase {
    /// Unit, as in `MPa`; `1` for a parameter without a unit.
    #[serde(default = "one")]
    pub unit: String,
    /// Symbol in figures and tables. Default: the name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// The prior, written as in `[prior]`.
    pub prior: Prior,
}

impl FreeParameterCase {
    /// The calibrated parameter with this name.
    pub(super) fn parameter(&self, name: &str) -> Parameter {
        let label = self.label.clone().unwrap_or_else(|| name.to_owned());
        Parameter::new(FreeParameter { name: name.to_owned(), label, unit: self.unit.clone() })
    }
}

/// Whether `[prior]` is omitted when the case is written: the prior is missing, or all its parameters are
/// declared in `[parameters]`.
pub(super) fn is_unwritten(prior: &Option<PriorCase>) -> bool {
    prior.as_ref().is_none_or(|prior| {
        prior.parameters().len() > 0 && prior.parameters().all(Parameter::is_free)
    })
}

/// Serialises `[prior]` without the parameters that are declared in `[parameters]`.
pub(super) fn write_prior<S: Serializer>(
    prior: &Option<PriorCase>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let all = prior.iter().flat_map(|prior| prior.iter());
    let priors_of_case = all.filter(|(parameter, _)| !parameter.is_free());
    let priors_of_case: PriorCase = priors_of_case
        .map(|(parameter, priors_of_case)| (parameter.clone(), *priors_of_case))
        .collect();
    priors_of_case.serialize(serializer)
}

fn one() -> String {
    "1".to_owned()
}
