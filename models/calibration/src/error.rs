//! Errors in files that the user wrote.

use std::fmt;
use std::path::Path;

/// Error in a file that the user wrote: location, value, problem, and how to fix it.
///
/// # Example
/// ```
/// use breccia_calibration::InputError;
/// let error = InputError::new("case.toml".as_ref(), "test.steps", "0", "must be at least 1", "Write steps = 44.");
/// assert_eq!(error.to_string(), "case.toml: test.steps = 0: must be at least 1. Write steps = 44.");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// Path of the file as given by the user.
    pub file: String,
    /// Location in the file: the key of a case, or the line and column of a table; empty if the error concerns the
    /// whole file.
    pub place: String,
    /// Value at this location; empty if the location has no value.
    pub value: String,
    /// Description of the problem: a clause without subject, such as `must be at least 1`.
    pub problem: String,
    /// How to fix the problem: one or more whole sentences.
    pub help: Box<str>,
    /// The line of the file; `None` if the value is not in the file, or the error names the line in `place`.
    pub excerpt: Option<Box<Excerpt>>,
}

/// One line of a file with marks below the value that has the error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// Number of the line, from 1.
    pub line: usize,
    /// The line and the marks below it, ready to print.
    pub picture: String,
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, place, value, problem, help, excerpt } = self;
        let located = located(place, value);
        match excerpt {
            None => write!(f, "{file}: {located}{problem}. {help}"),
            Some(excerpt) => {
                let Excerpt { line, picture } = &**excerpt;
                write!(f, "{file}:{line}: {located}{problem}.\n{picture}\nhelp: {help}")
            }
        }
    }
}

impl std::error::Error for InputError {}

impl InputError {
    /// Creates an error at `place` of `file`; `place` and `value` may be empty. Long texts are shortened.
    pub fn new(
        file: &Path,
        place: impl Into<String>,
        value: impl Into<String>,
        problem: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self {
            file: file.display().to_string(),
            place: shortened(place.into(), 200),
            value: shortened(value.into(), 100),
            problem: shortened(problem.into(), 500),
            help: shortened(help.into(), 2000).into(),
            excerpt: None,
        }
    }

    /// Creates the error of a file that cannot be opened or read.
    pub fn unreadable(file: &Path, error: &std::io::Error, help: impl Into<String>) -> Self {
        Self::new(file, "", "", format!("cannot be read ({error})"), help)
    }
}

/// Describes why `path` is not a regular file: it does not exist, or it is a folder, a pipe or a device.
pub fn absence(path: &Path) -> &'static str {
    match path.exists() {
        true => "is a folder, a pipe or a device, not a regular file",
        false => "there is no such file",
    }
}

fn located(place: &str, value: &str) -> String {
    match (place.is_empty(), value.is_empty()) {
        (true, _) => String::new(),
        (false, true) => format!("{place}: "),
        (false, false) => format!("{place} = {value}: "),
    }
}

/// Shortens a text to `most` characters and appends the number of characters removed. Without this limit, a value from
/// a broken file could be as long as the file.
fn shortened(text: String, most: usize) -> String {
    let Some((end, _)) = text.char_indices().nth(most) else { return text };
    let rest = text[end..].chars().count();
    format!("{}… ({rest} more characters)", &text[..end])
}

/// Returns the parts of a word before each of its underscores, and the word itself: `height` and `height_mm` for
/// `height_mm`.
fn stems(word: &str) -> impl Iterator<Item = &str> {
    word.match_indices('_').map(|(end, _)| &word[..end]).chain([word])
}

/// Returns the candidate closest to `word` in edit distance, `None` if no candidate is close enough to be the intended
/// word. `word` may lack the unit, as in `height` for `height_mm`.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // a long text is not a misspelled word, and its edit distance is expensive
    if word.len() > 100 {
        return None;
    }
    let distance = |candidate: &str| {
        let short = stems(candidate).map(|stem| strsim::osa_distance(word, stem));
        let long = stems(word).map(|stem| strsim::osa_distance(stem, candidate));
        short.chain(long).min()
    };
    // between candidates at the same distance, the distance of the whole word decides
    let (distance, _, best) = candidates
        .into_iter()
        .filter_map(|candidate| {
            Some((distance(candidate)?, strsim::osa_distance(word, candidate), candidate))
        })
        .min()?;
    (distance <= 1 + word.chars().count() / 4).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_pen_is_recognised_and_another_word_is_not() {
        let keys = ["radius_mm", "height_mm", "spacing_mm"];
        assert_eq!(closest("radus_mm", keys), Some("radius_mm"));
        assert_eq!(closest("hieght_mm", keys), Some("height_mm"));
        assert_eq!(closest("temperature", keys), None);
    }

    #[test]
    fn a_unit_that_was_left_out_is_recognised() {
        let keys = ["radius_mm", "height_mm", "spacing_mm", "viscosity_mpa_s"];
        assert_eq!(closest("hieght", keys), Some("height_mm"));
        assert_eq!(closest("viscosty", keys), Some("viscosity_mpa_s"));
        assert_eq!(closest("temperature", keys), None);
        assert_eq!(closest("height_mm", ["id", "hieght", "radius_mm"]), Some("hieght"));
    }

    #[test]
    fn a_message_is_never_as_long_as_a_broken_file() {
        let long = "ü".repeat(100_000);
        let error = InputError::new("x.csv".as_ref(), &long, &long, &long, &long).to_string();
        assert!(error.chars().count() < 4000, "{} characters", error.chars().count());
        assert!(error.contains("more characters"), "{error}");
    }
}
