//! Fingerprints of the inputs of a stage: parts of the case by key, and files by name.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::content_hash::ContentHash;
use crate::case::Case;

/// Fingerprint of a key of the case, or of a file, that does not exist.
const ABSENT: &str = "absent";

/// Size in bytes from which a file has a [`Stamp`]. Hashing a smaller file takes no noticeable time.
const LARGE: u64 = 1 << 20;

/// Time after a modification within which a second modification may have the same modification time, because file
/// systems round times.
const TIME_RESOLUTION: Duration = Duration::from_secs(2);

/// Size in bytes and modification time (ns since 1970) of a large file. A file with an unchanged stamp is not hashed
/// again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Stamp(u64, u64);

impl Stamp {
    /// The present stamp of a file; `None` for a folder, a small file, and a file that does not exist.
    fn of(path: &Path) -> Option<Self> {
        let metadata = path.metadata().ok().filter(|m| m.is_file() && m.len() >= LARGE)?;
        let age = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        Some(Self(metadata.len(), age.as_nanos().try_into().ok()?))
    }

    /// Whether a later modification of the file will have another modification time.
    fn is_settled(self) -> bool {
        let modified = UNIX_EPOCH + Duration::from_nanos(self.1);
        SystemTime::now().duration_since(modified).is_ok_and(|age| age > TIME_RESOLUTION)
    }
}

/// Possible inputs of a stage: a case, and the files of its results folder.
pub(crate) struct Origin<'a> {
    values: toml::Table,
    dir: &'a Path,
}

impl<'a> Origin<'a> {
    pub(crate) fn of(case: &Case, dir: &'a Path) -> Self {
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
    pub(crate) fn part(&self, key: &str) -> String {
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

    /// Fingerprint of the content of a file of the results folder, or of a file with an absolute path.
    fn content(&self, name: &str) -> String {
        ContentHash::of_path(&self.path(name))
            .map_or_else(|_| ABSENT.to_owned(), |sum| sum.to_string())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }
}

/// The copy of a results folder, with changed paths of inputs.
pub(crate) struct Move<'a> {
    pub(crate) from: Origin<'a>,
    pub(crate) to: Origin<'a>,
    /// Returns the name of a file in the records of the copy, given its name in the records of the original.
    pub(crate) new_name: &'a dyn Fn(&str) -> String,
}

impl Move<'_> {
    /// Fingerprint of a key in the copy; `None` if `sum` is not the present fingerprint in the original.
    pub(crate) fn part(&self, key: &str, sum: &str) -> Option<String> {
        (self.from.part(key) == sum).then(|| self.to.part(key))
    }

    /// Name and fingerprint of a file in the copy. The fingerprint remains if `sum` is not the present fingerprint in the
    /// original.
    pub(crate) fn file(&self, name: &str, sum: &str) -> (String, String) {
        let new = (self.new_name)(name);
        let is_present = self.from.content(name) == sum;
        let content = if is_present { self.to.content(&new) } else { sum.to_owned() };
        (new, content)
    }
}

/// Keys of the case and names of files that were read, each with the fingerprint of its content at that time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sources {
    case: BTreeMap<String, String>,
    files: BTreeMap<String, String>,
    /// Stamps of large files at the time when they were hashed; absent in records of earlier versions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    stamps: BTreeMap<String, Stamp>,
}

impl Sources {
    /// Keys of the case that were read.
    pub(crate) fn case_keys(&self) -> impl Iterator<Item = &str> {
        self.case.keys().map(String::as_str)
    }

    /// Names of the files that were read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Names of the files that existed when they were read, with their fingerprints.
    pub(crate) fn contents(&self) -> impl Iterator<Item = (&str, &str)> {
        let there = self.files.iter().filter(|(_, sum)| *sum != ABSENT);
        there.map(|(name, sum)| (name.as_str(), sum.as_str()))
    }

    /// Records that a key of the case was read.
    pub(crate) fn read_part(&mut self, origin: &Origin<'_>, key: &str) {
        self.case.insert(key.to_owned(), origin.part(key));
    }

    /// Records that a file was read.
    pub(crate) fn read_file(&mut self, origin: &Origin<'_>, name: &str) {
        // the stamp is read before the content: a change while the file is hashed changes the stamp
        let stamp = Stamp::of(&origin.path(name));
        if self.has_stamp(name, stamp) {
            return;
        }
        self.files.insert(name.to_owned(), origin.content(name));
        self.stamps.remove(name);
        self.stamps.extend(stamp.filter(|s| s.is_settled()).map(|stamp| (name.to_owned(), stamp)));
    }

    /// Whether a file was hashed when it had this stamp.
    fn has_stamp(&self, name: &str, stamp: Option<Stamp>) -> bool {
        stamp.is_some() && self.stamps.get(name).copied() == stamp
    }

    /// Returns the record of the same stage in a copy of the results folder. Entries that are out of date remain so.
    pub(crate) fn moved(&self, moved: &Move<'_>) -> Self {
        let part = |(key, sum): (&String, &String)| {
            (key.clone(), moved.part(key, sum).unwrap_or_else(|| sum.clone()))
        };
        let mut sources = Self { case: self.case.iter().map(part).collect(), ..Self::default() };
        for (name, sum) in &self.files {
            let new = (moved.new_name)(name);
            if moved.from.content(name) == *sum {
                sources.read_file(&moved.to, &new);
            } else {
                sources.files.insert(new, sum.clone());
            }
        }
        sources
    }

    /// The entries of some keys and files as text, one per line. Keys and files are sorted by name.
    pub(crate) fn lines(&self, keys: &[&str], files: &[&str]) -> String {
        let keys = self.case.iter().filter(|(key, _)| keys.contains(&key.as_str()));
        let files = self.files.iter().filter(|(name, _)| files.contains(&name.as_str()));
        keys.chain(files).map(|(name, sum)| format!("{name} = {sum}\n")).collect()
    }

    /// Describes the first entry whose content has changed; `None` if no content has changed.
    pub(crate) fn change(&self, origin: &Origin<'_>) -> Option<String> {
        let case = self.case.iter().find(|(key, sum)| origin.part(key) != **sum);
        let has_changed = |(name, sum): &(&String, &String)| {
            !self.has_stamp(name, Stamp::of(&origin.path(name))) && origin.content(name) != **sum
        };
        let file = || self.files.iter().find(has_changed);
        case.map(|(key, _)| match key.is_empty() {
            true => "the case has changed".to_owned(),
            false => format!("{key} has changed in the case"),
        })
        .or_else(|| file().map(|(name, _)| format!("{name} has changed")))
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;
    use crate::case::CaseFile;

    /// The content of a large file is read once, unless its size or its modification time changes. A change is found
    /// also in records without stamps, and if the file was modified just before it was read.
    #[test]
    fn a_large_file_is_hashed_once() {
        let dir = tempfile::tempdir().unwrap();
        let case = CaseFile::default_case().case;
        let origin = Origin::of(&case, dir.path());
        let path = dir.path().join("stack.tif");
        let written = |content: u8, age_s: u64| {
            std::fs::write(&path, vec![content; LARGE as usize]).unwrap();
            let time = UNIX_EPOCH + Duration::from_secs(1_700_000_000 - age_s);
            File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
        };
        let change = |sources: &Sources| sources.change(&origin);
        written(1, 100);
        let mut sources = Sources::default();
        sources.read_file(&origin, "stack.tif");
        assert_eq!((sources.stamps.len(), change(&sources)), (1, None));
        let text = toml::to_string(&sources).unwrap();
        assert_eq!(toml::from_str::<Sources>(&text).unwrap(), sources);

        // a changed content with the same stamp is not detected, which shows that the file is not hashed
        written(2, 100);
        assert_eq!(change(&sources), None);
        let before = sources.clone();
        sources.read_file(&origin, "stack.tif");
        assert_eq!(sources, before);
        let older = Sources { stamps: BTreeMap::new(), ..sources.clone() };
        assert_eq!(change(&older).as_deref(), Some("stack.tif has changed"));
        // another modification time with the same content does not count as a change; another content does
        written(1, 50);
        assert_eq!(change(&sources), None);
        written(2, 50);
        assert_eq!(change(&sources).as_deref(), Some("stack.tif has changed"));
        sources.read_file(&origin, "stack.tif");
        assert_eq!(change(&sources), None);

        // a file that was modified just now has no stamp
        std::fs::write(&path, vec![3; LARGE as usize]).unwrap();
        sources.read_file(&origin, "stack.tif");
        assert!(sources.stamps.is_empty());
        std::fs::write(&path, vec![4; LARGE as usize]).unwrap();
        assert_eq!(change(&sources).as_deref(), Some("stack.tif has changed"));
    }
}
