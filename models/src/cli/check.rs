//! `breccia check`: prints the interpreted input to standard output and mistakes to standard error.

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use crate::study::{PartCheck, StudyCheck};
use crate::workflow::CaseCheck;

use super::failure::Failure;
use super::output::print_line;

/// Prints the interpreted input of a case or a study; exit code 1 if there are mistakes.
pub(super) fn check(path: &Path) -> Result<ExitCode, Failure> {
    if !StudyCheck::is_study(path) {
        let CaseCheck { understood, notes, warnings, mistakes, tests, .. } = CaseCheck::read(path);
        print_understood(&understood)?;
        for (test, understood) in &tests {
            print_line(format_args!("\n{test}"))?;
            print_understood(understood)?;
        }
        if !tests.is_empty() {
            print_line("")?;
        }
        return conclude(&notes, &warnings, &mistakes);
    }
    let StudyCheck { understood, parts, notes, warnings, mistakes } = StudyCheck::read(path);
    print_understood(&understood)?;
    for PartCheck { folder, understood } in parts {
        print_line(format_args!("\n{folder}"))?;
        print_understood(&understood)?;
    }
    print_line("")?;
    conclude(&notes, &warnings, &mistakes)
}

fn print_understood(lines: &[(&str, String)]) -> Result<(), Failure> {
    lines.iter().try_for_each(|(subject, text)| print_line(format_args!("{subject:>10}  {text}")))
}

/// Prints notes, warnings, mistakes and the number of mistakes.
fn conclude(
    notes: &[String],
    warnings: &[String],
    mistakes: &[String],
) -> Result<ExitCode, Failure> {
    for (kind, lines) in [("note", notes), ("warning", warnings)] {
        for line in lines {
            print_line(format_args!("{kind:>10}  {line}"))?;
        }
    }
    let mut stderr = std::io::stderr();
    for mistake in mistakes {
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
