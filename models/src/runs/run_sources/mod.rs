//! Sources of the runs of a case. A source is a type that implements [`RunSource`] in a separate file, with an entry
//! in [`SOURCES`].
//!
//! In layers, lowest first:
//! 1. `process`, `result_file`: a program of the user with a time limit, and the file that it writes
//! 2. `built_in`, `command`, `table`: the sources
//! 3. this module: the list of the sources

mod built_in;
mod command;
mod process;
mod result_file;
mod table;

pub(crate) use command::check_program;
pub(crate) use table::ImportedRuns;

use super::run_source::RunSource;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;

/// Function that opens a source, if the case uses this source.
type Open = fn(&Inputs<'_>) -> Result<Option<Box<dyn RunSource>>, WorkflowError>;

/// All sources. A case uses the first source whose function returns a source for this case.
const SOURCES: [Open; 3] = [command::open, table::open, built_in::open];

/// Returns the source of the runs of a case.
///
/// # Errors
/// Fails if a file of the source cannot be read.
pub(crate) fn source_of(inputs: &Inputs<'_>) -> Result<Box<dyn RunSource>, WorkflowError> {
    for open_source in SOURCES {
        if let Some(source) = open_source(inputs)? {
            return Ok(source);
        }
    }
    Err(WorkflowError::Unusable("the case has no source of runs".to_owned()))
}
