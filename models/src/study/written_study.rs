//! The syntax of a study file.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Table;

use super::reference::Reference;
use crate::case::CaseFile;
use crate::error::InputError;

/// Folder of the laboratories, within the folder of the study.
pub(super) const LABORATORIES: &str = "laboratories";
/// Folder of the runs that cases share, within the folder of the study.
const RUNS: &str = "runs";

/// A study as written in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStudy {
    pub(super) title: String,
    pub(super) base: PathBuf,
    #[serde(default)]
    pub(super) laboratory: Vec<WrittenPart>,
    #[serde(default)]
    pub(super) case: Vec<WrittenPart>,
    #[serde(default)]
    pub(super) variant: Vec<WrittenVariant>,
}

/// A variant: keys that are changed in all cases, or in all laboratories, for a second run of the study.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenVariant {
    pub(super) name: String,
    pub(super) title: String,
    #[serde(default)]
    pub(super) set: Table,
    #[serde(default)]
    pub(super) laboratory: WrittenChange,
    /// Further keys that are changed in individual cases.
    #[serde(default)]
    pub(super) case: Vec<WrittenOwnChange>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenOwnChange {
    pub(super) name: String,
    pub(super) set: Table,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenChange {
    #[serde(default)]
    pub(super) set: Table,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenPart {
    pub(super) name: String,
    #[serde(default)]
    pub(super) laboratory: Option<String>,
    /// Keys of the base case that the part changes.
    #[serde(default)]
    pub(super) set: Table,
    /// Keys of the base case that the part removes.
    #[serde(default)]
    pub(super) without: Vec<String>,
    #[serde(default)]
    pub(super) reference: Reference,
}

impl WrittenStudy {
    /// Reads a study file. Returns its text, and the study that the text describes.
    ///
    /// # Errors
    /// If the file cannot be read, is not a study, or has no case.
    pub(super) fn read(path: &Path) -> Result<(String, Self), InputError> {
        let text = fem::read_regular_text(path)
            .map_err(|e| InputError::unreadable(path, &e, "Check its name and folder."))?;
        let written: Self = toml::from_str(&text).map_err(|e| {
            if CaseFile::parse(&text, path).is_ok() {
                let help = format!("Run it with: breccia run {}", path.display());
                return InputError::new(path, "", "", "is a case and not a study", help);
            }
            let line = e.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            let help = "A study has the keys title, base, tables [[laboratory]] and [[case]] with name, \
                        laboratory, set, without, reference, and [[variant]] with name, title, set, \
                        laboratory.set, and [[variant.case]] with name, set.";
            InputError::new(path, format!("line {line}"), "", e.message().replace('\n', "; "), help)
        })?;
        if written.case.is_empty() {
            let help = "Add a table [[case]] for each calibration.";
            return Err(InputError::new(path, "case", "", "is missing", help));
        }
        Ok((text, written))
    }

    /// Returns the mistakes in the names of laboratories, cases and variants. The names must be different, because they
    /// are names of folders within one folder.
    pub(super) fn name_mistakes(&self, path: &Path) -> Vec<InputError> {
        let mut mistakes = Vec::new();
        let mut names = vec![LABORATORIES, RUNS];
        let part_names = self.laboratory.iter().chain(&self.case).map(|part| &part.name);
        for name in part_names.chain(self.variant.iter().map(|variant| &variant.name)) {
            let mut refuse = |problem, help| {
                mistakes.push(InputError::new(path, "name", format!("{name:?}"), problem, help));
            };
            let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
            if !name.chars().all(is_plain) || name.trim_matches('.').is_empty() {
                refuse("is the name of a folder", "Use letters, digits and - _ only.");
            } else if names.contains(&name.as_str()) {
                refuse(
                    "is already used",
                    "Use different names for all laboratories, cases and variants.",
                );
            }
            names.push(name);
        }
        let names: Vec<&str> = self.case.iter().map(|case| case.name.as_str()).collect();
        for variant in &self.variant {
            for unknown in
                variant.case.iter().filter(|unknown| !names.contains(&unknown.name.as_str()))
            {
                let location = format!("{}.case.name", variant.name);
                let help = format!("Name one of: {}.", names.join(", "));
                let (value, problem) =
                    (format!("{:?}", unknown.name), "is not a case of the study");
                mistakes.push(InputError::new(path, location, value, problem, help));
            }
        }
        mistakes
    }
}
