//! The syntax of a study file.

use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use toml::Table;
use toml::de::DeTable;

use super::reference::Reference;
use crate::case::tables::wrong_lists;
use crate::case::{CaseFile, changed_case, schema_of};
use crate::error::InputError;

/// Folder of the laboratories, within the folder of the study.
pub(super) const LABORATORIES: &str = "laboratories";
/// Folder of the runs that cases share, within the folder of the study.
const RUNS: &str = "runs";

/// A study as written in the file.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStudy {
    /// Title of the study, for its report.
    pub(super) title: String,
    /// Path of the case that the laboratories and cases change, relative to the folder of the study.
    pub(super) base: PathBuf,
    /// Laboratories: specimens that several cases share, made by a separate case.
    #[serde(default)]
    pub(super) laboratory: Vec<WrittenPart>,
    /// The calibrations that are compared.
    #[serde(default)]
    pub(super) case: Vec<WrittenPart>,
    /// Variants: second runs of the study with other keys.
    #[serde(default)]
    pub(super) variant: Vec<WrittenVariant>,
}

/// A variant: keys that are changed in all cases, or in all laboratories, for a second run of the study.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenVariant {
    /// Name of the variant, and of its folder.
    pub(super) name: String,
    /// Title of the variant, for the report.
    pub(super) title: String,
    /// Keys that are changed in all cases, with their values.
    #[serde(default)]
    #[schemars(schema_with = "changed_keys")]
    pub(super) set: Table,
    /// Keys that are changed in all laboratories.
    #[serde(default)]
    pub(super) laboratory: WrittenChange,
    /// Further keys that are changed in individual cases.
    #[serde(default)]
    pub(super) case: Vec<WrittenOwnChange>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenOwnChange {
    /// Name of the case.
    pub(super) name: String,
    /// Keys that are changed in this case, with their values.
    #[schemars(schema_with = "changed_keys")]
    pub(super) set: Table,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenChange {
    /// Keys that are changed, with their values.
    #[serde(default)]
    #[schemars(schema_with = "changed_keys")]
    pub(super) set: Table,
}

#[derive(Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenPart {
    /// Name of the case or laboratory, and of its folder.
    pub(super) name: String,
    /// Name of the laboratory whose specimens the case uses.
    #[serde(default)]
    pub(super) laboratory: Option<String>,
    /// Keys of the base case that the part changes.
    #[serde(default)]
    #[schemars(schema_with = "changed_keys")]
    pub(super) set: Table,
    /// Keys of the base case that the part removes.
    #[serde(default)]
    pub(super) without: Vec<String>,
    /// Published results, with which the case is compared.
    #[serde(default)]
    pub(super) reference: Reference,
}

fn changed_keys(_: &mut SchemaGenerator) -> Schema {
    changed_case()
}

/// Returns the JSON Schema of study files.
pub(crate) fn study_schema() -> serde_json::Value {
    schema_of::<WrittenStudy>("Breccia study")
}

impl WrittenStudy {
    /// Reads a study file. Returns its text, and the study that the text describes.
    ///
    /// # Errors
    /// If the file cannot be read, is not a study, or has no case.
    pub(super) fn read(path: &Path) -> Result<(String, Self), InputError> {
        let text = fem::read_regular_text(path)
            .map_err(|e| InputError::unreadable(path, &e, "Check its name and folder."))?;
        let (mut table, errors) = DeTable::parse_recoverable(&text);
        let lists = wrong_lists(table.get_mut(), &study_schema());
        if let (Some(list), true) = (lists.first(), errors.is_empty()) {
            return Err(list.error(&text, path));
        }
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::case::schema::tests::{compare, undescribed};
    use crate::case::schema::validator::check;

    #[test]
    fn every_key_of_a_study_is_described() {
        assert_eq!(undescribed(&study_schema()), [""; 0]);
    }

    #[test]
    fn the_schema_has_the_keys_of_a_study() {
        compare(&study_schema(), |place, file| {
            let error = match file.to_string().parse::<Table>().unwrap().try_into::<WrittenStudy>()
            {
                Ok(_) => panic!("{place}: {file} is not refused"),
                Err(error) => error.message().to_owned(),
            };
            let mut words = error.split('`').skip(1).step_by(2);
            assert_eq!(words.next(), Some("zzz"), "{place}: {error}");
            Some(words.map(str::to_owned).collect::<BTreeSet<_>>())
                .filter(|words| !words.contains("young_mpa"))
        });
    }

    #[test]
    fn studies_are_accepted_and_wrong_ones_refused_by_reader_and_schema() {
        let schema = study_schema();
        let read = |text: &str| {
            let table: Table = text.parse().unwrap();
            let of_schema = check(&schema, &schema, &serde_json::to_value(&table).unwrap(), "");
            (table.try_into::<WrittenStudy>().is_ok(), of_schema)
        };
        for text in [
            include_str!("../../../studies/bonded-granular.toml"),
            include_str!("../../../studies/viscoelastic.toml"),
        ] {
            assert_eq!(read(text), (true, Ok(())));
        }
        let study = "title = \"a\"\nbase = \"case.toml\"\n[[case]]\nname = \"b\"\n";
        assert_eq!(read(study), (true, Ok(())));
        for (from, to) in [
            ("title", "titel"),
            ("\"a\"", "1"),
            ("base = \"case.toml\"", ""),
            ("name", "nam"),
            ("name", "without = \"a\"\nname"),
            ("name", "reference.map.matrix.yuong_mpa = 1\nname"),
        ] {
            let (of_reader, of_schema) = read(&study.replacen(from, to, 1));
            assert!(!of_reader && of_schema.is_err(), "{to}: {of_reader} {of_schema:?}");
        }
        // the keys that a case changes are read with the case
        for set in ["specimen.radus_mm = 1", "design.runs = \"many\"", "design.runs = 1"] {
            let (_, of_schema) = read(&format!("{study}set.{set}\n"));
            assert!(of_schema.is_err(), "{set}");
        }
    }
}
