//! The file with the records of the finished stages of a results folder, and the format of the folder.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::task::StageRecord;
use crate::results_folder::error::WorkflowError;

/// Name of the file with the records of finished stages.
pub(crate) const STAGES_FILE: &str = "stages.toml";

/// Format of a results folder, which `stages.toml` and the identity of runs state. A folder of another format is refused.
///
/// Raise the number with every change after which results of an earlier commit must not be used: another layout of a file
/// that a stage reads, another identity of runs, or a mended fault that changes results. The version of the program does
/// not suffice, because it changes with releases only. Folders without a number have format 1.
pub(crate) const FORMAT: u32 = 2;

/// Records of the finished stages by name: the inputs and the products of each stage.
pub(crate) type Records = BTreeMap<String, StageRecord>;

/// Content of the file.
#[derive(Serialize, Deserialize)]
struct StagesFile {
    #[serde(default = "first_format")]
    format: u32,
    #[serde(flatten)]
    stages: Records,
}

fn first_format() -> u32 {
    1
}

/// Content of the file in any format.
#[derive(Deserialize)]
struct AnyFormat {
    #[serde(default = "first_format")]
    format: u32,
    #[serde(flatten)]
    stages: BTreeMap<String, AnyRecord>,
}

/// Part of the record of a stage that all formats have.
#[derive(Deserialize)]
struct AnyRecord {
    #[serde(rename = "program")]
    _program: String,
}

/// Reads the records of the finished stages of a results folder; empty for a folder of another format.
pub(crate) fn finished_in(dir: &Path) -> Records {
    let file: Option<StagesFile> = read(dir);
    file.filter(|file| file.format == FORMAT).map(|file| file.stages).unwrap_or_default()
}

/// Returns the content of the file with these records.
pub(crate) fn to_text(stages: Records) -> String {
    let file = StagesFile { format: FORMAT, stages };
    toml::to_string(&file).expect("names and fingerprints are plain text")
}

/// Checks that the results in a folder, if there are any, have the present format. The file of a user, which has no
/// records of stages, is not refused here.
///
/// # Errors
/// [`WorkflowError::OtherFormat`].
pub(crate) fn check_format(dir: &Path) -> Result<(), WorkflowError> {
    match read::<AnyFormat>(dir) {
        Some(AnyFormat { format, stages }) if format != FORMAT && !stages.is_empty() => {
            Err(WorkflowError::OtherFormat { path: dir.to_owned(), format, present: FORMAT })
        }
        _ => Ok(()),
    }
}

fn read<T: for<'de> Deserialize<'de>>(dir: &Path) -> Option<T> {
    let text = fem::read_regular_text(&dir.join(STAGES_FILE)).ok()?;
    toml::from_str(&text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECORD: &str = "[mesh]\nprogram = \"0.1.0\"\n\n[mesh.case]\nspecimen = \"0a\"\n\n\
        [mesh.files]\n\n[mesh.products]\n\"mesh.msh\" = \"1b\"\n";

    #[test]
    fn records_are_read_back_and_folders_of_another_format_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(STAGES_FILE);
        check_format(dir.path()).unwrap();
        let write = |text: &str| std::fs::write(&path, text).unwrap();
        write(&format!("format = {FORMAT}\n\n{RECORD}"));
        check_format(dir.path()).unwrap();
        let records = finished_in(dir.path());
        assert!(records["mesh"].has_written("mesh.msh"));
        write(&to_text(records.clone()));
        assert_eq!(finished_in(dir.path()), records);

        // records of another format may have other tables
        let other_record = RECORD.replacen("[mesh.products]", "[mesh.further]", 1);
        for (first, format) in [("", 1), ("format = 1\n", 1), ("format = 999\n", 999)] {
            for record in [RECORD, &other_record] {
                let text = format!("{first}{record}");
                write(&text);
                assert!(finished_in(dir.path()).is_empty(), "{text}");
                let error = check_format(dir.path()).unwrap_err().to_string();
                for part in [&*format!("format {format}"), "--out", "version of breccia"] {
                    assert!(error.contains(part), "{part}: {error}");
                }
                assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
            }
        }
        // files of a user
        for text in ["", "title = \"stages of my work\"\n", "[one]\nlength_m = 3\n"] {
            write(text);
            check_format(dir.path()).unwrap();
            assert!(finished_in(dir.path()).is_empty());
        }
    }
}
