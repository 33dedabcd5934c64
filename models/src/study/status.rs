//! State of the results of a study, read from its folder.

use std::path::Path;

use super::shift::TESTING;
use crate::workflow::{StageStatus, Together, WorkflowError, status};

/// State of a laboratory or a case of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct PartStatus {
    /// Folder of the part within the folder of the study.
    pub name: String,
    /// State of each stage of the part.
    pub stages: Vec<StageStatus>,
}

/// Returns the state of each part of a study, or of each test of a case with several tests, in order. Returns `None` if
/// the folder belongs to neither.
///
/// # Errors
/// If the state of a part cannot be read.
pub fn study_status(dir: &Path) -> Result<Option<Vec<PartStatus>>, WorkflowError> {
    let Some(together) = Together::read(dir) else { return Ok(None) };
    let laboratories = together.laboratories.into_iter().map(|name| (name, true));
    let cases = together.cases.into_iter().map(|name| (name, false));
    let part_status = |(name, is_laboratory): (String, bool)| {
        let mut stages = match status(&dir.join(&name)) {
            Ok(stages) => stages,
            // the part has not been started
            Err(WorkflowError::NoResults { .. }) => StageStatus::none(),
            Err(error) => return Err(error),
        };
        if is_laboratory {
            stages.retain(|stage| TESTING.contains(&stage.stage));
        }
        Ok(PartStatus { name, stages })
    };
    let mut study_parts: Vec<PartStatus> =
        laboratories.chain(cases).map(part_status).collect::<Result<_, _>>()?;
    // a case with several tests has joint stages in addition to the stages of its tests
    if dir.join("case.toml").is_file() {
        study_parts.push(PartStatus { name: "all tests".to_owned(), stages: status(dir)? });
    }
    Ok(Some(study_parts))
}
