//! The command line: what can be asked for, and what is printed at the end.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use models::{Case, CaseFile, InputError, STAGES, Stage, Workflow, WorkflowError};

/// Calibrates the fracture of bonded granular materials, with uncertainty.
///
/// From the compression curves of specimens and a finite-element model of their microstructure to
/// the posterior of stiffness, toughness and viscosity of the matrix. Without arguments the shipped
/// default case runs: virtual specimens, 100 simulations, surrogate, posterior, confirmation, report.
#[derive(Parser)]
#[command(name = "breccia", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,

    /// Simulations at the same time; results do not depend on it [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

const EXAMPLES: &str = "\
Examples:
  breccia                                   the default case, results in breccia-out/
  breccia init my.toml                      write a case that explains every key
  breccia simulate my.toml --out try        one simulation: try/curve.csv
  breccia run my.toml --out results         everything; interrupt it and run it again to go on
  breccia calibrate --out results           one stage again, after results/case.toml was edited

Stages, in order: segment, mesh, experiments, ensemble, surrogate, calibrate, confirm, report.
`breccia help STAGE` says what each reads and writes.";

#[derive(Subcommand)]
enum Command {
    /// Run all stages of a case that are not finished yet
    #[command(after_help = "Example:\n  breccia run my.toml --out results --threads 2")]
    Run(CaseAndFolder),
    /// Write the default case, every key explained
    #[command(after_help = "Example:\n  breccia init my.toml")]
    Init {
        /// The file to write; an existing one is never replaced
        #[arg(default_value = "case.toml")]
        file: PathBuf,
    },
    /// Run one compression test with the case's own parameters: curve.csv
    #[command(after_help = "Example:\n  breccia simulate my.toml --out try")]
    Simulate(CaseAndFolder),
}

#[derive(Args)]
struct CaseAndFolder {
    /// The case; without it DIR/case.toml if there is one, else the shipped default case
    case: Option<PathBuf>,

    /// Where results are written, and found again
    #[arg(long, value_name = "DIR", default_value = "breccia-out")]
    out: PathBuf,
}

impl CaseAndFolder {
    fn case_file(&self) -> Result<CaseFile, InputError> {
        let own = self.out.join("case.toml");
        match &self.case {
            Some(path) => CaseFile::read(path),
            None if own.is_file() => CaseFile::read(&own),
            None => Ok(CaseFile::default_case()),
        }
    }
}

/// Raised by Ctrl-C; a second one ends the program at once.
static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Runs the program: exit code 0 when all is done, 1 after an error, 2 for a wrong command line,
/// 130 after Ctrl-C.
pub(crate) fn main() -> ExitCode {
    let (threads, request) = request();
    let handler = ctrlc::set_handler(|| {
        if INTERRUPT.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!("\nstopping after the current load steps; press Ctrl-C again to stop at once");
    });
    if let Err(error) = handler {
        eprintln!("note: Ctrl-C will not end cleanly ({error})");
    }
    let threads = threads
        .map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
    match run(request, threads) {
        Ok(()) => ExitCode::SUCCESS,
        Err(WorkflowError::Interrupted) => {
            eprintln!("{}", WorkflowError::Interrupted);
            ExitCode::from(130)
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// What is asked for.
enum Request {
    /// No command: the default case.
    Default,
    Command(Command),
    Stage(&'static Stage, CaseAndFolder),
}

/// Reads the command line, to which every stage of the table adds a command.
fn request() -> (Option<u16>, Request) {
    let stages = STAGES.iter().map(|stage| {
        let example = format!("Example:\n  breccia {} my.toml --out results", stage.name);
        let writes = format!("Writes {}.\n{example}", stage.products.join(", "));
        CaseAndFolder::augment_args(clap::Command::new(stage.name))
            .about(stage.about)
            .after_help(writes)
    });
    let matches = Cli::command().subcommands(stages).get_matches();
    let threads = matches.get_one::<u16>("threads").copied();
    let stage = matches.subcommand().and_then(|(name, own)| Some((Stage::named(name)?, own)));
    let request = match stage {
        Some((stage, own)) => {
            CaseAndFolder::from_arg_matches(own).map(|t| Request::Stage(stage, t))
        }
        None => Cli::from_arg_matches(&matches)
            .map(|cli| cli.command.map_or(Request::Default, Request::Command)),
    };
    (threads, request.unwrap_or_else(|error| error.exit()))
}

fn run(request: Request, threads: usize) -> Result<(), WorkflowError> {
    match request {
        // no command, no surprises: the default case, not whatever lies in the folder
        Request::Default => run_all(&CaseFile::default_case(), Path::new("breccia-out"), threads),
        Request::Command(Command::Run(target)) => {
            run_all(&target.case_file()?, &target.out, threads)
        }
        Request::Command(Command::Init { file }) => init(&file),
        Request::Command(Command::Simulate(target)) => {
            let path = models::simulate(&target.case_file()?, &target.out, &INTERRUPT)?;
            println!("{}", path.display());
            Ok(())
        }
        Request::Stage(stage, target) => {
            Workflow::open(&target.case_file()?, &target.out, threads, &INTERRUPT)?.run(stage)
        }
    }
}

fn run_all(file: &CaseFile, out: &Path, threads: usize) -> Result<(), WorkflowError> {
    // before anything is made, and in the user's own file
    file.table()?;
    let workflow = Workflow::open(file, out, threads, &INTERRUPT)?;
    workflow.run_all()?;
    for name in ["summary.txt", "map.csv", "confirm.csv"] {
        let path = out.join(name);
        let text = std::fs::read_to_string(&path)
            .map_err(|source| WorkflowError::Io { path: path.clone(), source })?;
        println!("{}:\n{text}", path.display());
    }
    println!("report: {}", out.join("report.html").display());
    Ok(())
}

fn init(file: &Path) -> Result<(), WorkflowError> {
    let created = std::fs::OpenOptions::new().write(true).create_new(true).open(file);
    created
        .and_then(|mut f| f.write_all(Case::TEMPLATE.as_bytes()))
        .map_err(|source| WorkflowError::Init { path: file.to_owned(), source })?;
    println!("wrote {}; next: breccia run {} --out results", file.display(), file.display());
    Ok(())
}
