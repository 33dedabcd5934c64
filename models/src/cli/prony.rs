//! `breccia prony`: fits a Prony series to a relaxation test or a dynamic test. Existing files are never replaced.

use std::path::{Path, PathBuf};

use crate::WorkflowError;
use crate::progress::say;
use crate::prony::{MeasuredModuli, PronyFit, check_fit, prony_picture};
use crate::workflow::create_file;

use super::failure::{Failure, file_error};
use super::output::print_line;

/// Fits the table, prints the lines for a case, and writes them and a figure into a folder.
pub(super) fn prony(table: &Path, folder: &Path) -> Result<(), Failure> {
    let data = MeasuredModuli::read(table).map_err(WorkflowError::from)?;
    let stem = table.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let paths = [format!("{stem}-prony.toml"), format!("{stem}-prony.png")];
    let [lines, picture]: [PathBuf; 2] = paths.map(|name| folder.join(name));
    let init = |path: &Path, source| WorkflowError::Init { path: path.to_owned(), source };
    for path in [&lines, &picture] {
        if path.symlink_metadata().is_ok() {
            let source = std::io::ErrorKind::AlreadyExists.into();
            return Err(init(path, source).into());
        }
    }
    let fit = PronyFit::new(&data);
    let warning = check_fit(&fit, &data, table).map_err(WorkflowError::from)?;
    let text = fit.series.to_toml();
    let drawn = prony_picture(&data, &fit).map_err(|source| file_error(&picture, source))?;
    std::fs::create_dir_all(folder).map_err(|source| init(folder, source))?;
    create_file(&lines, text.as_bytes()).map_err(|source| init(&lines, source))?;
    create_file(&picture, &drawn).map_err(|source| init(&picture, source))?;
    warning.iter().for_each(|warning| say("warning", warning));
    let (terms, percent) = (fit.series.terms.len(), 100.0 * fit.relative_error);
    print_line(format_args!("{terms} terms, mean relative error {percent:.2} %"))?;
    print_line(text.trim_end())?;
    print_line(format_args!("wrote {} and {}", lines.display(), picture.display()))
}
