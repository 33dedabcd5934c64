//! Writing results so that a kill at any moment leaves whole files.

use std::path::Path;

use super::WorkflowError;

/// Writes a text through a temporary file beside it; folders are made as needed.
pub(super) fn write(path: &Path, text: &str) -> Result<(), WorkflowError> {
    let io = |e: std::io::Error| WorkflowError::io(path, &e);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(io)?;
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    // another process may be writing the same file
    name.push(format!(".{}.partial", std::process::id()));
    let partial = path.with_file_name(name);
    std::fs::write(&partial, text).map_err(io)?;
    std::fs::rename(&partial, path).map_err(io)
}

/// A CSV text from a header and rows of cells.
pub(super) fn csv_text<R, C>(header: &str, rows: R) -> String
where
    R: IntoIterator<Item = C>,
    C: IntoIterator<Item = String>,
{
    let mut text = format!("{header}\n");
    for row in rows {
        let cells: Vec<String> = row.into_iter().map(quoted).collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// A cell, in quotes where it holds a separator.
fn quoted(cell: String) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\"").replace('\n', " "))
    } else {
        cell
    }
}
