//! How far a study has come, seen from outside.

use std::path::Path;

use super::shift::TESTING;
use crate::workflow::{StageStatus, Together, WorkflowError, status};

/// How far a laboratory or a case of a study has come.
#[derive(Clone, Debug, PartialEq)]
pub struct PartStatus {
    /// Its folder.
    pub name: String,
    /// Its stages.
    pub stages: Vec<StageStatus>,
}

/// How far each part of a study has come, in order. Nothing if the folder is none of a study.
///
/// # Errors
/// A part that cannot be read.
pub fn study_status(dir: &Path) -> Result<Option<Vec<PartStatus>>, WorkflowError> {
    let Some(together) = Together::read(dir) else { return Ok(None) };
    let laboratories = together.laboratories.into_iter().map(|name| (name, true));
    let cases = together.cases.into_iter().map(|name| (name, false));
    let of = |(name, is_laboratory): (String, bool)| {
        let mut stages = match status(&dir.join(&name)) {
            Ok(stages) => stages,
            // it has not begun
            Err(WorkflowError::NoResults { .. }) => StageStatus::none(),
            Err(error) => return Err(error),
        };
        if is_laboratory {
            stages.retain(|stage| TESTING.contains(&stage.stage));
        }
        Ok(PartStatus { name, stages })
    };
    laboratories.chain(cases).map(of).collect::<Result<_, _>>().map(Some)
}
