//! Collects all warnings of a results folder: the warnings of the rules and of the stages.

use super::RULES;
use super::rule::Warning;
use crate::pipeline::extensions::further_stages;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::{WARNING_STAGES, warnings_of};

/// Applies the rules to the results of the finished stages, and returns their warnings.
///
/// # Errors
/// Fails if a result is missing or cannot be read.
pub(crate) fn of_rules(
    inputs: &Inputs<'_>,
    is_done: &dyn Fn(&str) -> bool,
) -> Result<Vec<Warning>, WorkflowError> {
    let mut warnings = Vec::new();
    for rule in RULES.iter().filter(|rule| rule.reads.iter().all(|stage| is_done(stage))) {
        warnings.extend((rule.check)(inputs)?);
    }
    Ok(warnings)
}

/// Returns the warnings that the finished stages have written.
///
/// # Errors
/// Fails if a file cannot be read.
pub(crate) fn of_stages(
    inputs: &Inputs<'_>,
    is_done: &dyn Fn(&str) -> bool,
) -> Result<Vec<Warning>, WorkflowError> {
    let mut warnings = Vec::new();
    let further = further_stages().iter().map(|stage| stage.name);
    for stage in WARNING_STAGES.into_iter().chain(further).filter(|stage| is_done(stage)) {
        let name = warnings_of(stage);
        if inputs.file_if_there(&name).is_none() {
            continue;
        }
        let text = inputs.text(&name)?;
        let warning = |line: &str| Warning { text: line.to_owned(), qualifier: None };
        warnings.extend(text.lines().map(warning));
    }
    Ok(warnings)
}
