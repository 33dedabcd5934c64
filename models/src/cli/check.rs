//! `breccia check`: what was understood on standard output, mistakes on standard error.

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use models::CaseCheck;

use super::failure::Failure;
use super::output::print_line;

/// Prints what the files of a case say: exit code 1 if there are mistakes.
pub(super) fn check(case: &Path) -> Result<ExitCode, Failure> {
    let CaseCheck { understood, notes, mistakes } = CaseCheck::read(case);
    for (subject, text) in understood {
        print_line(format_args!("{subject:>10}  {text}"))?;
    }
    for note in notes {
        print_line(format_args!("{:>10}  {note}", "note"))?;
    }
    let mut stderr = std::io::stderr();
    for mistake in &mistakes {
        let _ = writeln!(stderr, "error: {mistake}");
    }
    match mistakes.len() {
        0 => {
            print_line("no mistakes")?;
            return Ok(ExitCode::SUCCESS);
        }
        1 => drop(writeln!(stderr, "1 mistake")),
        count => drop(writeln!(stderr, "{count} mistakes")),
    }
    Ok(ExitCode::FAILURE)
}
