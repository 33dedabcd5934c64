//! All warnings of a folder of results: what rules find, and what stages have warned of.

use super::WorkflowError;
use super::files::{WARNING_STAGES, warnings_of};
use super::inputs::Inputs;
use super::rule::Warning;
use super::rules::RULES;

/// What the rules find in the results of the stages that are done.
///
/// # Errors
/// A result that is missing or cannot be read.
pub(super) fn of_rules(
    inputs: &Inputs<'_>,
    is_done: &dyn Fn(&str) -> bool,
) -> Result<Vec<Warning>, WorkflowError> {
    let mut found = Vec::new();
    for rule in RULES.iter().filter(|rule| rule.reads.iter().all(|stage| is_done(stage))) {
        found.extend((rule.check)(inputs)?);
    }
    Ok(found)
}

/// What the stages that are done have warned of while they ran.
///
/// # Errors
/// A file that cannot be read.
pub(super) fn of_stages(
    inputs: &Inputs<'_>,
    is_done: &dyn Fn(&str) -> bool,
) -> Result<Vec<Warning>, WorkflowError> {
    let mut found = Vec::new();
    for stage in WARNING_STAGES.iter().filter(|stage| is_done(stage)) {
        let name = warnings_of(stage);
        if inputs.file_if_there(&name).is_none() {
            continue;
        }
        let text = inputs.text(&name)?;
        let warning = |line: &str| Warning { text: line.to_owned(), qualifier: None };
        found.extend(text.lines().map(warning));
    }
    Ok(found)
}
