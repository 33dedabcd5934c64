//! Fingerprints of the inputs of a stage: parts of the case by key, and files by name.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::content_hash::ContentHash;
use crate::case::Case;

/// Fingerprint of a key of the case, or of a file, that does not exist.
const ABSENT: &str = "absent";

/// Possible inputs of a stage: a case, and the files of its results folder.
pub(super) struct Origin<'a> {
    values: toml::Table,
    dir: &'a Path,
}

impl<'a> Origin<'a> {
    pub(super) fn of(case: &Case, dir: &'a Path) -> Self {
        let mut values = toml::Table::try_from(case).unwrap_or_default();
        // the key `prior` stands for all priors, including the priors in `[parameters]`
        for (name, parameter) in &case.parameters {
            let prior = toml::Value::try_from(parameter.prior);
            let priors = values.entry("prior").or_insert_with(|| toml::Table::new().into());
            if let (Some(priors), Ok(prior)) = (priors.as_table_mut(), prior) {
                priors.insert(name.clone(), prior);
            }
        }
        Self { values, dir }
    }

    /// Fingerprint of the value at a key of the case; of the whole case if the key is empty.
    pub(super) fn part(&self, key: &str) -> String {
        if key.is_empty() {
            return ContentHash::of(&self.values.to_string()).to_string();
        }
        let mut keys = key.split('.');
        let first = keys.next().and_then(|key| self.values.get(key));
        keys.fold(first, |value, key| value?.get(key)).map_or_else(
            || ABSENT.to_owned(),
            |value| ContentHash::of(&value.to_string()).to_string(),
        )
    }

    fn content(&self, name: &str) -> String {
        ContentHash::of_path(&self.dir.join(name))
            .map_or_else(|_| ABSENT.to_owned(), |sum| sum.to_string())
    }
}

/// Keys of the case and names of files that were read, each with the fingerprint of its content at that time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sources {
    case: BTreeMap<String, String>,
    files: BTreeMap<String, String>,
}

impl Sources {
    /// Keys of the case that were read.
    pub(super) fn parts(&self) -> impl Iterator<Item = &str> {
        self.case.keys().map(String::as_str)
    }

    /// Names of the files that were read.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Names of the files that existed when they were read, with their fingerprints.
    pub(super) fn contents(&self) -> impl Iterator<Item = (&str, &str)> {
        let there = self.files.iter().filter(|(_, sum)| *sum != ABSENT);
        there.map(|(name, sum)| (name.as_str(), sum.as_str()))
    }

    /// Records that a key of the case was read.
    pub(super) fn read_part(&mut self, origin: &Origin<'_>, key: &str) {
        self.case.insert(key.to_owned(), origin.part(key));
    }

    /// Records that a file was read.
    pub(super) fn read_file(&mut self, origin: &Origin<'_>, name: &str) {
        self.files.insert(name.to_owned(), origin.content(name));
    }

    /// All entries as text, one per line.
    pub(super) fn manifest(&self) -> String {
        self.case.iter().chain(&self.files).map(|(name, sum)| format!("{name} = {sum}\n")).collect()
    }

    /// Describes the first entry whose content has changed; `None` if no content has changed.
    pub(super) fn change(&self, origin: &Origin<'_>) -> Option<String> {
        let case = self.case.iter().find(|(key, sum)| origin.part(key) != **sum);
        let file = || self.files.iter().find(|(name, sum)| origin.content(name) != **sum);
        case.map(|(key, _)| match key.is_empty() {
            true => "the case has changed".to_owned(),
            false => format!("{key} has changed in the case"),
        })
        .or_else(|| file().map(|(name, _)| format!("{name} has changed")))
    }
}
