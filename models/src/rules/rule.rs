//! Types of the rules on the results, and of their warnings.

use crate::pipeline::inputs::Inputs;
use crate::report::Qualifier;
use crate::results_folder::error::WorkflowError;

/// Warning that a reader of a result must know before using the result.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Warning {
    /// Text of the warning: consequence for the result, cause and remedy.
    pub(crate) text: String,
    /// Restriction that is added to the verdict "identified", if any.
    pub(crate) qualifier: Option<Qualifier>,
}

/// Condition on the results of stages. If the condition is violated, warnings are issued.
pub(crate) struct Rule {
    /// Stages whose files the rule reads.
    pub(crate) reads: &'static [&'static str],
    /// Returns the warnings for a results folder; empty if the condition is satisfied.
    pub(crate) check: fn(&Inputs<'_>) -> Result<Vec<Warning>, WorkflowError>,
}

/// Returns a single warning with a qualifier.
pub(crate) fn qualified(qualifier: Qualifier, text: String) -> Vec<Warning> {
    vec![Warning { text, qualifier: Some(qualifier) }]
}
