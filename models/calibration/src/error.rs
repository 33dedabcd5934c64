//! What a person gets to read when a file of theirs is wrong.

use std::path::Path;

/// A mistake in a file that a person wrote: the place, the value, what is wrong and what to do about it.
///
/// It reads `case.toml: specimen.radius_mm = -2.5: must lie between 0.001 and 1000 mm. Give …`.
///
/// # Example
/// ```
/// use breccia_calibration::InputError;
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
            place: shortened(place.into(), 200),
            value: shortened(value.into(), 100),
            problem: shortened(problem.into(), 500),
            help: shortened(help.into(), 2000),
        }
    }

    /// The file cannot be opened or read.
    pub fn unreadable(file: &Path, error: &std::io::Error, help: impl Into<String>) -> Self {
        Self::new(file, "", "", format!("cannot be read ({error})"), help)
    }
}

/// What is wrong with a file that should be there and be a regular file.
pub fn absence(path: &Path) -> &'static str {
    match path.exists() {
        true => "is a folder, a pipe or a device, and no regular file",
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

/// The text, cut where it is longer than this many characters: what a broken file holds may be as long
/// as the file.
fn shortened(text: String, most: usize) -> String {
    let Some((end, _)) = text.char_indices().nth(most) else { return text };
    let rest = text[end..].chars().count();
    format!("{}… ({rest} characters more)", &text[..end])
}

/// The word, and what of it stands before each of its underscores.
fn stems(word: &str) -> impl Iterator<Item = &str> {
    word.match_indices('_').map(|(end, _)| &word[..end]).chain([word])
}

/// The candidate that `word` was probably meant to be, by edit distance; its unit may have been left
/// out, as in `height` for `height_mm`.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // of a long text, nothing is a slip, and distances are costly
    if word.len() > 100 {
        return None;
    }
    let distance = |candidate: &str| {
        let short = stems(candidate).map(|stem| strsim::osa_distance(word, stem));
        let long = stems(word).map(|stem| strsim::osa_distance(stem, candidate));
        short.chain(long).min()
    };
    // the whole word decides between candidates that begin alike
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
        assert!(error.contains("characters more"), "{error}");
    }
}
