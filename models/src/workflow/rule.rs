//! What a rule on the results is, and what it warns of.

use super::WorkflowError;
use super::inputs::Inputs;
use crate::report::Qualifier;

/// Something that the reader of a result has to know before using it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Warning {
    /// The consequence for the result, its cause, and what to do.
    pub(super) text: String,
    /// What it makes of "identified", if anything.
    pub(super) qualifier: Option<Qualifier>,
}

/// A condition on the results of stages, and what to say where they do not meet it.
pub(super) struct Rule {
    /// The stages whose files it reads.
    pub(super) reads: &'static [&'static str],
    /// The warnings of a folder of results; none where the condition holds.
    pub(super) check: fn(&Inputs<'_>) -> Result<Vec<Warning>, WorkflowError>,
}

/// The warning as the only one of a rule.
pub(super) fn qualified(qualifier: Qualifier, text: String) -> Vec<Warning> {
    vec![Warning { text, qualifier: Some(qualifier) }]
}
