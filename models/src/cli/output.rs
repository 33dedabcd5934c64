//! Output to standard output, which may be closed or full.

use std::fmt::Display;
use std::io::{ErrorKind, Write as _};

use super::failure::Failure;

/// Prints a line. A closed pipe (as after `head`) is not an error, because the results are in files.
///
/// # Errors
/// [`Failure::Output`] if the line cannot be written for another reason.
pub(super) fn print_line(line: impl Display) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{line}").and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::Output(error)),
        _ => Ok(()),
    }
}
