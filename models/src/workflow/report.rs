//! Stage `report`: figures and tables of the whole job on one page.

use super::fingerprint::Fingerprint;
use super::{Stage, Workflow, WorkflowError};

pub(super) fn inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    // the numbers of every stage end in one of these
    Stage::ALL
        .into_iter()
        .filter(|&stage| stage != Stage::Report)
        .try_fold(Fingerprint::new().part(w.case()), |inputs, stage| {
            inputs.file(&w.needed(stage.product(), stage)?)
        })
}

pub(super) fn run(w: &Workflow) -> Result<String, WorkflowError> {
    let path = crate::report::write(w.dir())?;
    Ok(path.display().to_string())
}
