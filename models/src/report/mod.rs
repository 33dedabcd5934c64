//! The report: figures and one self-contained HTML page, from the files of the stages.

mod figures;
mod load;
mod mesh_picture;
mod page;
mod results;
mod style;

use std::path::{Path, PathBuf};

use crate::workflow::WorkflowError;

pub use mesh_picture::mesh_picture;

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Writes `report.html` in the directory of a finished workflow.
///
/// # Errors
/// A file of a stage is missing or damaged; the report cannot be written.
pub fn write(dir: &Path) -> Result<PathBuf, WorkflowError> {
    let results = load::load(dir)?;
    let path = dir.join("report.html");
    std::fs::write(&path, page::page(&results)).map_err(|e| WorkflowError::io(&path, &e))?;
    Ok(path)
}
