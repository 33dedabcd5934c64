//! `breccia init`: writes a first case, and never replaces existing files.

use std::io::ErrorKind;
use std::path::Path;

use crate::workflow::create_file;
use crate::{Case, WorkflowError};

use super::failure::Failure;
use super::output::print_line;

/// Writes a case for measured specimens, with a specimen table and curves that the user replaces.
pub(super) fn init_own_data(folder: &Path) -> Result<(), Failure> {
    // check all paths first, so that no file of the user is replaced and no incomplete example is written
    let is_there = |name: &str| folder.join(name).symlink_metadata().is_ok();
    if let Some((name, _)) = Case::OWN_DATA.iter().find(|(name, _)| is_there(name)) {
        let source = ErrorKind::AlreadyExists.into();
        return Err(WorkflowError::Init { path: folder.join(name), source }.into());
    }
    for (name, text) in Case::OWN_DATA {
        let path = folder.join(name);
        path.parent()
            .map_or(Ok(()), std::fs::create_dir_all)
            .map_err(|source| WorkflowError::Init { path: path.clone(), source })?;
        create(&path, text)?;
    }
    let [table, curves, case] = ["specimens.csv", "curves", "case.toml"]
        .map(|name| folder.join(name).display().to_string());
    print_line(format_args!(
        "wrote {case} with examples: put your own specimens into {table} and {curves}"
    ))?;
    print_line(format_args!("next: breccia run {case} --out results"))
}

/// Writes the default case.
pub(super) fn init(file: &Path) -> Result<(), Failure> {
    create(file, Case::TEMPLATE)?;
    let file = file.display();
    print_line(format_args!("wrote {file}; next: breccia run {file} --out results"))
}

/// Creates a file that must not exist yet. The file is written completely or not at all.
fn create(file: &Path, text: &str) -> Result<(), WorkflowError> {
    create_file(file, text.as_bytes())
        .map_err(|source| WorkflowError::Init { path: file.to_owned(), source })
}
