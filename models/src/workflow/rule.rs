//! Types of the rules on the results, and of their warnings.

use super::WorkflowError;
use super::inputs::Inputs;
use crate::report::Qualifier;

/// Warning that a reader of a result must know before using the result.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Warning {
    /// Text of the warning: consequence for the result, cause and remedy.
    pub(super) text: String,
    /// Restriction that is added to the verdict "identified", if any.
    pub(super) qualifier: Option<Qualifier>,
}

/// Condition on the results of stages. If the condition is violated, warnings are issued.
pub(super) struct Rule {
    /// Stages whose files the rule reads.
    pub(super) reads: &'static [&'static str],
    /// Returns the warnings for a results folder; empty if the condition is satisfied.
    pub(super) check: fn(&Inputs<'_>) -> Result<Vec<Warning>, WorkflowError>,
}

/// Returns a single warning with a qualifier.
pub(super) fn qualified(qualifier: Qualifier, text: String) -> Vec<Warning> {
    vec![Warning { text, qualifier: Some(qualifier) }]
}
