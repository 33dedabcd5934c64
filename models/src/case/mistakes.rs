//! Reads a case that may contain several mistakes: an entry that cannot be read is omitted, and the rest is read.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error};

use super::Case;
use super::tables::{WrongList, remove_wrong_lists};
use crate::error::{InputError, closest};

/// Mistakes in the order in which they are found.
#[derive(Debug, Default)]
pub(crate) struct Mistakes(Vec<InputError>);

impl Mistakes {
    /// Adds the error of a check, if the check failed.
    pub(crate) fn note(&mut self, checked: Result<(), InputError>) {
        self.0.extend(checked.err());
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn into_vec(self) -> Vec<InputError> {
        self.0
    }
}

/// Result of reading a text: the case, if it could be read, and the errors.
pub(super) struct ReadCase {
    /// The case; `None` if a required entry is missing or an error could not be skipped.
    pub(super) case: Option<Case>,
    /// Errors of the parser.
    pub(super) errors: Vec<Error>,
    /// Lists that were omitted because the schema does not allow them.
    pub(super) lists: Vec<WrongList>,
    /// Keys that were omitted because they could not be read.
    omitted: Vec<String>,
}

impl ReadCase {
    /// Reads the text of a case. A misspelt key is replaced by the closest known key; any other entry that cannot be
    /// read is omitted.
    pub(super) fn of(text: &str) -> Self {
        let (mut table, errors) = DeTable::parse_recoverable(text);
        let lists = remove_wrong_lists(table.get_mut());
        let omitted = lists.iter().map(|list| list.last_key().to_owned()).collect();
        let mut read = Self { case: None, errors, lists, omitted };
        // a text with syntax errors has no reliable entries
        let is_toml = read.errors.is_empty();
        while is_toml && read.errors.len() <= MOST {
            let error = match Case::deserialize(Deserializer::from(table.clone())) {
                Ok(case) => {
                    read.case = Some(case);
                    break;
                }
                Err(error) => error,
            };
            let is_missing = error.message().starts_with("missing field");
            let omitted = error.span().filter(|_| !is_missing);
            let omitted = omitted.and_then(|at| omit(table.get_mut(), &at, error.message()));
            let key = error.message().split('`').nth(1).unwrap_or_default();
            if !(is_missing && read.is_omitted(key)) {
                read.errors.push(error);
            }
            match omitted {
                Some(key) => read.omitted.push(key),
                None => break,
            }
        }
        read
    }

    /// Whether a mistake is only a consequence of an omitted entry.
    pub(super) fn explains(&self, mistake: &InputError) -> bool {
        mistake.place.rsplit('.').next().is_some_and(|key| self.is_omitted(key))
    }

    fn is_omitted(&self, key: &str) -> bool {
        self.omitted.iter().any(|omitted| omitted == key)
    }
}

/// Limit of the number of mistakes that are read from one text.
const MOST: usize = 50;

/// Removes the entry at the range `at` of the text, or renames its key to the closest known key. Returns the removed
/// key, or an empty string if the key was renamed. Returns `None` if there is no entry at `at`.
fn omit(table: &mut DeTable<'_>, at: &Range<usize>, message: &str) -> Option<String> {
    let is_key = |(key, _): &(&Spanned<_>, &Spanned<DeValue<'_>>)| key.span() == *at;
    if let Some(key) = table.iter().find(is_key).map(|(key, _)| key.clone()) {
        let value = table.remove(&key)?;
        let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        let allowed = names.split_first().map(|(_, allowed)| allowed).unwrap_or_default();
        let meant = closest(key.get_ref(), allowed.iter().copied());
        let Some(meant) = meant.filter(|_| message.starts_with("unknown field")) else {
            return Some(key.into_inner().into_owned());
        };
        let meant = Spanned::new(key.span(), meant.to_owned().into());
        if !table.contains_key(&meant) {
            table.insert(meant, value);
        }
        return Some(String::new());
    }
    for (_, value) in table.iter_mut() {
        let within = match value.get_mut() {
            DeValue::Table(inner) => omit(inner, at, message),
            DeValue::Array(all) => {
                let tables = all.iter_mut().filter_map(|value| match value.get_mut() {
                    DeValue::Table(inner) => Some(inner),
                    _ => None,
                });
                tables.into_iter().find_map(|inner| omit(inner, at, message))
            }
            _ => None,
        };
        if within.is_some() {
            return within;
        }
    }
    let holds = |(_, value): &(&Spanned<_>, &Spanned<DeValue<'_>>)| {
        value.span().start <= at.start && at.end <= value.span().end
    };
    let key = table.iter().find(holds).map(|(key, _)| key.clone())?;
    table.remove(&key);
    Some(key.into_inner().into_owned())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::CaseFile;
    use super::*;

    fn mistakes(changes: &[(&str, &str)]) -> Vec<String> {
        let mut text = Case::TEMPLATE.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "the default case has no {from:?}");
            text = text.replacen(from, to, 1);
        }
        let (_, mistakes) = CaseFile::parse_all(&text, Path::new("case.toml"));
        mistakes.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn every_mistake_is_named_once() {
        let reported = mistakes(&[
            ("radius_mm = 2.5", "radus_mm = 2.5"),
            ("height_mm = 4.4", "height_mm = \"4.4 mm\""),
            ("law = \"hencky\"", "law = \"henky\""),
            ("[250.0, 300.0]", "[300.0, 250.0]"),
            ("runs = 100", "runs = 1"),
            ("draws = 2000", "draws = 2"),
        ]);
        let keys = [
            "radus_mm",
            "specimen.height_mm = \"4.4 mm\"",
            "material.matrix.law = \"henky\"",
            "prior.matrix.young_mpa = [300.0, 250.0]",
            "design.runs = 1",
            "calibration.draws = 2",
        ];
        for key in keys {
            assert_eq!(
                reported.iter().filter(|one| one.contains(key)).count(),
                1,
                "{key}: {reported:#?}"
            );
        }
        assert_eq!(reported.len(), keys.len(), "{reported:#?}");
    }

    #[test]
    fn several_mistakes_of_syntax_are_named() {
        let reported =
            mistakes(&[("radius_mm = 2.5", "radius_mm = 2,5"), ("runs = 100", "runs == 100")]);
        assert!(reported.iter().any(|one| one.contains("specimen.radius_mm")), "{reported:#?}");
        assert!(reported.iter().any(|one| one.contains("design.runs")), "{reported:#?}");
    }

    #[test]
    fn a_right_case_has_none() {
        assert_eq!(mistakes(&[]), [""; 0]);
    }
}
