//! The parsed command line.

use std::io::Write as _;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, FromArgMatches};

use super::arguments::{CaseAndFolder, Cli, Command};
use super::cluster::Sharing;
use super::failure::Failure;
use crate::workflow::FORMER_NAMES;
use crate::{STAGES, Stage};

/// The parsed command line.
pub(super) enum Request {
    /// No command: run the default case.
    Default,
    Command(Command),
    Stage(&'static Stage, CaseAndFolder, Option<Sharing>),
}

/// Parses the command line into the number of threads and a request. Each stage of [`STAGES`] adds a command.
pub(super) fn request() -> (usize, Request) {
    let stages = STAGES.iter().map(|stage| {
        let example = format!("Example:\n  breccia {} my.toml --out results", stage.name);
        let writes = format!("Writes {}.\n{example}", stage.products.join(", "));
        let command = CaseAndFolder::augment_args(clap::Command::new(stage.name));
        let command = if stage.is_shared() { Sharing::augment_args(command) } else { command };
        command.about(stage.about).after_help(writes)
    });
    let former = FORMER_NAMES.iter().map(|(name, present)| {
        let command = CaseAndFolder::augment_args(clap::Command::new(*name)).hide(true);
        command.about(format!("Former name of {present}"))
    });
    let matches = Cli::command().subcommands(stages).subcommands(former).try_get_matches();
    let matches = matches.unwrap_or_else(|error| exit_with(&with_hint(error)));
    let threads = matches.get_one::<u16>("threads").copied();
    let threads = threads
        .map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
    let stage = matches.subcommand().and_then(|(name, arguments)| {
        Some((Stage::named(name).or_else(|| Stage::formerly_named(name))?, arguments))
    });
    let request = match stage {
        Some((stage, arguments)) => CaseAndFolder::from_arg_matches(arguments).and_then(|target| {
            let sharing =
                stage.is_shared().then(|| Sharing::from_arg_matches(arguments)).transpose()?;
            Ok(Request::Stage(stage, target, sharing))
        }),
        None => Cli::from_arg_matches(&matches)
            .map(|cli| cli.command.map_or(Request::Default, Request::Command)),
    };
    (threads, request.unwrap_or_else(|error| error.exit()))
}

/// Prints help, the version or an error of the command line, and ends the program.
fn exit_with(error: &clap::Error) -> ! {
    let code = match error.print() {
        Err(io) if io.kind() != std::io::ErrorKind::BrokenPipe => {
            let _ = writeln!(std::io::stderr(), "error: {}", Failure::Output(io));
            1
        }
        _ => error.exit_code(),
    };
    std::process::exit(code)
}

/// Adds a hint to `breccia run` if a case file was given instead of a command.
fn with_hint(error: clap::Error) -> clap::Error {
    match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(word)) if word.ends_with(".toml") => Cli::command().error(
            ErrorKind::InvalidSubcommand,
            format!("{word:?} is not a command; did you mean `breccia run {word}`?"),
        ),
        _ => error,
    }
}
