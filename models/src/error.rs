//! What a person gets to read when a file of theirs is wrong.

use std::path::Path;

/// A mistake in a file that a person wrote: the place, the value, what is wrong and what to do about it.
///
/// It reads `case.toml: specimen.radius_mm = -2.5: must lie between 0.001 and 1000 mm. Give …`.
///
/// # Example
/// ```
/// use models::InputError;
/// let error = InputError::new("case.toml".as_ref(), "test.steps", "0", "must be at least 1", "Write steps = 44.");
/// assert_eq!(error.to_string(), "case.toml: test.steps = 0: must be at least 1. Write steps = 44.");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {}{problem}. {help}", located(place, value))]
pub struct InputError {
    /// The file as the person named it.
    pub file: String,
    /// The key of a case, or the line and column of a table; empty when it is the file as a whole.
    pub place: String,
    /// The value found there; empty when nothing was found.
    pub value: String,
    /// What is wrong with it.
    pub problem: String,
    /// What to do about it: one or more whole sentences.
    pub help: String,
}

impl InputError {
    /// An error at `place` of `file`; `value` may be empty.
    pub fn new(
        file: &Path,
        place: impl Into<String>,
        value: impl Into<String>,
        problem: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self {
            file: file.display().to_string(),
            place: place.into(),
            value: value.into(),
            problem: problem.into(),
            help: help.into(),
        }
    }

    /// The file cannot be opened or read.
    pub fn unreadable(file: &Path, error: &std::io::Error, help: impl Into<String>) -> Self {
        Self::new(file, "", "", format!("cannot be read ({error})"), help)
    }
}

fn located(place: &str, value: &str) -> String {
    match (place.is_empty(), value.is_empty()) {
        (true, _) => String::new(),
        (false, true) => format!("{place}: "),
        (false, false) => format!("{place} = {value}: "),
    }
}

/// The candidate that `word` was probably meant to be, by edit distance.
pub(crate) fn closest<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let (distance, best) = candidates
        .into_iter()
        .map(|candidate| (strsim::levenshtein(word, candidate), candidate))
        .min()?;
    (distance <= 1 + word.chars().count() / 3).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_pen_is_recognised_and_another_word_is_not() {
        let keys = ["radius_mm", "height_mm", "spacing_mm"];
        assert_eq!(closest("radus_mm", keys), Some("radius_mm"));
        assert_eq!(closest("temperature", keys), None);
    }
}
