//! Input data of a problem: checks, discretisation, warnings.

#[expect(clippy::module_inception, reason = "the module is named after its main type")]
mod definition;
mod discretisation;
mod fingerprint;
mod rounding;
mod setup;
mod warning;

pub use warning::ProblemWarning;

pub(crate) use definition::Definition;
pub(crate) use discretisation::Discretisation;
pub(crate) use fingerprint::Fingerprint;
pub(crate) use setup::Setup;
pub(crate) use warning::warnings;
