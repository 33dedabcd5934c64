//! The command line: parsing of arguments, commands, and the final output.

mod check;
mod cluster;
mod failure;
mod init;
mod output;
mod prony;
mod ranks;
mod replace;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::{
    CaseFile, FolderAccess, InputError, JointWorkflow, PartStatus, Registry, STAGES, Stage,
    StageStatus, Study, StudyFile, SurfaceOptions, Workflow, WorkflowError, missing_case,
};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use fem::Ranks;

use check::check;
use cluster::{Jobs, Sharing, slurm, slurm_study};
use failure::Failure;
use init::{init, init_own_data};
use output::print_line;
use prony::prony;
use replace::replaceable;

/// Calibrates the fracture of bonded granular materials, with uncertainty.
///
/// Computes the posterior of stiffness, toughness and viscosity of the matrix from the compression curves of specimens
/// and a finite-element model of their microstructure. Without arguments, the built-in default case runs: virtual
/// specimens, 100 simulations, surrogate, posterior, confirmation, report.
#[derive(Parser)]
#[command(name = "breccia", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,

    /// Number of simultaneous simulations; results do not depend on it [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

const EXAMPLES: &str = "\
Examples:
  breccia                                   the default case, results in breccia-out/
  breccia init my.toml                      write a case that explains every key
  breccia init --own-data my-tests          write a case for your own curves, with example curves
  breccia check my.toml                     print the interpreted input, the expected cost and every mistake
  breccia simulate my.toml --out try        one simulation: try/curve.csv
  breccia surfaces my.toml --out try        the surface of each grain: try/surfaces/grain-001.stl
  breccia prony relaxation.csv --out try    a Prony series of a relaxation test
  breccia run my.toml --out results         all stages; the same command resumes an interrupted run
  breccia calibrate --out results           one stage again, after results/case.toml was edited
  breccia status results                    state of the results, on any machine that has access to the folder
  breccia ensemble --out results --slurm    the simulations of a case as jobs of a Slurm cluster
  breccia study my-study.toml --out study   several calibrations and their comparison
  breccia study my-study.toml --out study --slurm   the same as jobs of a Slurm cluster

Stages, in order: segment, mesh, experiments, ensemble, surrogate, calibrate, confirm, validate,
verdict, design, report.
`breccia help STAGE` describes a stage and the files that it writes.";

#[derive(Subcommand)]
enum Command {
    /// Run all stages of a case that are not finished yet
    #[command(after_help = "Example:\n  breccia run my.toml --out results --threads 2")]
    Run(CaseAndFolder),
    /// Write the default case, with an explanation of every key
    #[command(after_help = "Example:\n  breccia init my.toml\n  breccia init --own-data my-tests")]
    Init {
        /// The file to write; an existing file is never replaced
        #[arg(default_value = "case.toml")]
        file: PathBuf,

        /// Write a case for measured specimens to DIR instead, with an example table and example curves
        #[arg(long, value_name = "DIR", conflicts_with = "file")]
        own_data: Option<PathBuf>,
    },
    /// Read a case and all files that it names; print the interpreted input, the expected cost and every mistake
    #[command(
        after_help = "Computes nothing and writes nothing. Exit code 0: no mistakes; 1: mistakes.\n\
                      For a study, all laboratories and cases are read.\n\
                      Example:\n  breccia check my.toml"
    )]
    Check {
        /// The case, or the study
        case: PathBuf,
    },
    /// Run one compression test with the parameters of the case; writes curve.csv
    #[command(after_help = "Example:\n  breccia simulate my.toml --out try\n\
                      Several processes, on one machine or more (built with --features mpi):\n  \
                      mpirun -n 4 breccia simulate my.toml --out try")]
    Simulate {
        #[command(flatten)]
        target: CaseAndFolder,

        /// Device that solves the linear systems
        #[arg(long, value_enum, default_value_t)]
        device: crate::DeviceChoice,
    },
    /// Write the surface of each grain as STL: surfaces/grain-001.stl, surfaces.csv
    #[command(after_help = "The surfaces are in mm, in the coordinates of the mesh:\n\
                      the axis of the specimen is z, and its bottom is at z = 0.\n\
                      Example:\n  breccia surfaces my.toml --out try\n\
                      With the paper's steps:\n  \
                      breccia surfaces my.toml --out try --smoothing-passes 10 --decimation 20 --least-distance-mm 0.01")]
    Surfaces {
        #[command(flatten)]
        target: CaseAndFolder,

        /// Passes of Taubin's filter over each surface
        #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1000))]
        smoothing_passes: u16,

        /// Divide the number of triangles by FACTOR
        #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
        decimation: f64,

        /// Shrink grains about their centroids until they are at least MM mm apart; 0: no shrinking
        #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = length)]
        least_distance_mm: f64,
    },
    /// Fit a Prony series to a relaxation test or a dynamic test (DMA); writes the lines for a case and a picture
    #[command(
        after_help = "TABLE is a CSV file with the columns time_s,modulus_mpa, or frequency_hz,storage_mpa,loss_mpa.\n\
                      Writes NAME-prony.toml and NAME-prony.png for a table NAME.csv; existing files are never replaced.\n\
                      Example:\n  breccia prony relaxation.csv --out try"
    )]
    Prony {
        /// Table of the measured moduli
        table: PathBuf,

        /// Folder for the files
        #[arg(long, value_name = "DIR", default_value = ".")]
        out: PathBuf,
    },
    /// Run several related calibrations and compare them; writes study.csv and report.html
    #[command(
        after_help = "Writes a folder of results for each case, with all files of `run`, and the comparison:\n\
                      DIR/study.csv and DIR/report.html. The same command resumes an interrupted study.\n\
                      Example:\n  breccia study studies/bonded-granular.toml --out study"
    )]
    Study {
        /// The study: a base case, and the keys that each laboratory and each case changes
        file: PathBuf,

        /// Results folder; a later run resumes from its files
        #[arg(long, value_name = "DIR", default_value = "breccia-study")]
        out: PathBuf,

        /// Set a key of all cases to another value, as in --set specimen.spacing_mm=0.3; may be repeated
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,

        /// Overwrite FILE in DIR even if you have written or edited it; may be repeated
        #[arg(long, value_name = "FILE")]
        replace: Vec<PathBuf>,

        /// Run only the laboratory or case whose folder within DIR is PART
        #[arg(long, value_name = "PART", conflicts_with_all = ["slurm", "slurm_script"])]
        only: Option<String>,

        /// Last stage to run, for the case given with --only
        #[arg(long, value_name = "STAGE", requires = "only")]
        until: Option<String>,

        #[command(flatten)]
        jobs: Jobs,
    },
    /// Show the state of each stage, on any machine that has access to the folder; changes no file
    #[command(
        after_help = "Prints one line per stage. Exit code 0: all stages are done; 3: work is left; 1: no results.\n\
                      Example:\n  breccia status results"
    )]
    Status {
        /// The folder that was given to `run`, `study` or a stage with --out
        #[arg(default_value = "breccia-out")]
        dir: PathBuf,
    },
}

#[derive(Args)]
struct CaseAndFolder {
    /// The case [default: DIR/case.toml if it exists, else the built-in default case]
    case: Option<PathBuf>,

    /// Results folder; a later run resumes from its files
    #[arg(long, value_name = "DIR", default_value = "breccia-out")]
    out: PathBuf,

    /// Use DIR for this case although it has results of another case; results with other inputs are computed again
    #[arg(long)]
    reuse: bool,

    /// Calibrate even if a measured mean is outside the range of all simulations; no parameter is then called
    /// identified
    #[arg(long)]
    accept_out_of_range: bool,

    /// Overwrite FILE in DIR even if you have written or edited it; may be repeated
    #[arg(long, value_name = "FILE")]
    replace: Vec<PathBuf>,
}

impl CaseAndFolder {
    fn case_file(&self) -> Result<CaseFile, InputError> {
        let copied_case = self.out.join("case.toml");
        match &self.case {
            Some(path) => CaseFile::read(path),
            None if copied_case.is_file() => CaseFile::read(&copied_case),
            None => missing_case(&self.out).map_or_else(|| Ok(CaseFile::default_case()), Err),
        }
    }

    fn access(&self) -> Result<FolderAccess, WorkflowError> {
        Ok(FolderAccess { reuse: self.reuse, replace: replaceable(&self.out, &self.replace)? })
    }

    /// Opens the folders of a case with several tests.
    fn open_tests<'a>(
        &self,
        file: &CaseFile,
        threads: usize,
    ) -> Result<JointWorkflow<'a>, WorkflowError> {
        let access = self.access()?;
        let workflow = JointWorkflow::open(file, &self.out, threads, &INTERRUPT, &access)?;
        Ok(if self.accept_out_of_range { workflow.accept_out_of_range() } else { workflow })
    }

    /// Returns the case for a command that works on a single test.
    fn single_test(&self, command: &str) -> Result<CaseFile, InputError> {
        let file = self.case_file()?;
        let Some(first) = file.case.tests.first() else { return Ok(file) };
        let case = self.out.join("tests").join(&first.name).join("case.toml");
        let help = format!(
            "Run a stage first, and then breccia {command} {} for one of them.",
            case.display()
        );
        Err(InputError::new(&file.path, "tests", "", "has several tests", help))
    }

    fn open<'a>(&self, file: &CaseFile, threads: usize) -> Result<Workflow<'a>, WorkflowError> {
        let workflow = Workflow::open_with(file, &self.out, threads, &INTERRUPT, &self.access()?)?;
        Ok(if self.accept_out_of_range { workflow.accept_out_of_range() } else { workflow })
    }
}

/// Set by Ctrl-C and by the signals TERM and HUP; a second signal ends the program at once.
static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Runs the program. Exit codes: 0 if everything is complete, 1 after an error, 2 for an invalid command line, 3 if
/// `status` finds unfinished work, 130 after Ctrl-C or another signal to end.
///
/// `registry` contains the quantities of interest and the parameters that cases can name: the entries of
/// [`Registry::standard`], and the extensions of the user's program.
pub fn program(registry: Registry) -> ExitCode {
    registry.install();
    let (threads, request) = request();
    let handler = ctrlc::set_handler(|| {
        if INTERRUPT.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        // standard error may be closed already, so that errors of writing are ignored
        let _ = match ranks::farewell() {
            Some(text) => writeln!(std::io::stderr(), "{text}"),
            None => writeln!(
                std::io::stderr(),
                "\nstopping after the current load steps; press Ctrl-C again to stop at once"
            ),
        };
    });
    if let Err(error) = handler {
        let _ = writeln!(
            std::io::stderr(),
            "note: Ctrl-C will stop the program without saving unfinished work ({error})"
        );
    }
    let mut stderr = std::io::stderr();
    let ranks = match ranks_of(&request) {
        Ok(ranks) => ranks,
        Err(error) => {
            let _ = writeln!(stderr, "error: {error}");
            return ExitCode::FAILURE;
        }
    };
    match run(request, threads, &ranks) {
        Err(_) if !ranks.is_first() => ExitCode::FAILURE,
        Ok(code) => code,
        Err(Failure::Workflow(WorkflowError::Interrupted)) => {
            let _ = writeln!(stderr, "{}", WorkflowError::Interrupted);
            ExitCode::from(130)
        }
        Err(error) => {
            let _ = writeln!(stderr, "error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The parsed command line.
enum Request {
    /// No command: run the default case.
    Default,
    Command(Command),
    Stage(&'static Stage, CaseAndFolder, Option<Sharing>),
}

/// Parses the command line into the number of threads and a request. Each stage of [`STAGES`] adds a command.
fn request() -> (usize, Request) {
    let stages = STAGES.iter().map(|stage| {
        let example = format!("Example:\n  breccia {} my.toml --out results", stage.name);
        let writes = format!("Writes {}.\n{example}", stage.products.join(", "));
        let command = CaseAndFolder::augment_args(clap::Command::new(stage.name));
        let command = if stage.is_shared() { Sharing::augment_args(command) } else { command };
        command.about(stage.about).after_help(writes)
    });
    let matches = Cli::command().subcommands(stages).try_get_matches();
    let matches = matches.unwrap_or_else(|error| exit_with(&with_hint(error)));
    let threads = matches.get_one::<u16>("threads").copied();
    let threads = threads
        .map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
    let stage =
        matches.subcommand().and_then(|(name, arguments)| Some((Stage::named(name)?, arguments)));
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

/// Returns the ranks that execute the request; only `simulate` can run on several ranks.
fn ranks_of(request: &Request) -> Result<Ranks, Failure> {
    let command = match request {
        Request::Command(Command::Simulate { .. }) => return ranks::ranks(),
        Request::Default | Request::Command(Command::Run(_)) => "run",
        Request::Command(Command::Init { .. }) => "init",
        Request::Command(Command::Check { .. }) => "check",
        Request::Command(Command::Surfaces { .. }) => "surfaces",
        Request::Command(Command::Prony { .. }) => "prony",
        Request::Command(Command::Study { .. }) => "study",
        Request::Command(Command::Status { .. }) => "status",
        Request::Stage(stage, ..) => stage.name,
    };
    ranks::refuse(command).map(|()| Ranks::default())
}

fn run(request: Request, threads: usize, ranks: &Ranks) -> Result<ExitCode, Failure> {
    match request {
        // without a command, the default case is run even if the folder contains another case
        Request::Default => {
            let (file, out) = (CaseFile::default_case(), Path::new("breccia-out"));
            run_all(&Workflow::open(&file, out, threads, &INTERRUPT)?)?;
        }
        Request::Command(Command::Run(target)) => {
            let file = target.case_file().map_err(WorkflowError::from)?;
            if !file.case.tests.is_empty() {
                run_all_tests(target.open_tests(&file, threads)?)?;
                return Ok(ExitCode::SUCCESS);
            }
            // check the table first, so that an error refers to the user's file and is reported before anything is
            // computed
            file.table().map_err(WorkflowError::from)?;
            run_all(&target.open(&file, threads)?)?;
        }
        Request::Command(Command::Init { own_data: Some(folder), .. }) => init_own_data(&folder)?,
        Request::Command(Command::Init { file, own_data: None }) => init(&file)?,
        Request::Command(Command::Check { case }) => return check(&case),
        Request::Command(Command::Simulate { target, device }) => {
            let file = target.single_test("simulate");
            let error = file.as_ref().err().map(ToString::to_string);
            let of_all = ranks.first_text(error.as_deref()).map_err(WorkflowError::from)?;
            let file = file.map_err(WorkflowError::from)?;
            if let Some((rank, message)) = of_all {
                return Err(WorkflowError::Rank { rank, message }.into());
            }
            ranks::remember(ranks, &target.out);
            let access = target.access()?;
            let path = crate::simulate(&file, &target.out, device, ranks, &INTERRUPT, &access)?;
            if ranks.is_first() {
                print_line(path.display())?;
            }
        }
        Request::Command(Command::Surfaces {
            target,
            smoothing_passes,
            decimation,
            least_distance_mm,
        }) => {
            let file = target.single_test("surfaces").map_err(WorkflowError::from)?;
            let smoothing_passes = usize::from(smoothing_passes);
            let options = SurfaceOptions { smoothing_passes, decimation, least_distance_mm };
            print_line(target.open(&file, threads)?.surfaces(&options)?.display())?;
        }
        Request::Command(Command::Prony { table, out }) => prony(&table, &out)?,
        Request::Command(Command::Study { file: path, out, set, replace, only, until, jobs }) => {
            let replace = replaceable(&out, &replace)?;
            let file = StudyFile::read(&path, &set).map_err(WorkflowError::from)?;
            let until = until.map(|name| stage_named(&name)).transpose()?;
            let study = Study::open(file, &out, threads, &INTERRUPT, &replace)?;
            if jobs.are_asked_for() {
                slurm_study(&study, &path, &set, &jobs, &replace)?;
                return Ok(ExitCode::SUCCESS);
            }
            if let Some(part) = only {
                study.run_part(&part, until)?;
                return Ok(ExitCode::SUCCESS);
            }
            study.run()?;
            for name in ["study.csv", "report.html"] {
                print_line(study.dir().join(name).display())?;
            }
        }
        Request::Command(Command::Status { dir }) => return status(&dir),
        Request::Stage(stage, target, sharing) => {
            let file = target.case_file().map_err(WorkflowError::from)?;
            if !file.case.tests.is_empty() {
                let mut workflow = target.open_tests(&file, threads)?;
                match sharing {
                    Some(sharing) if sharing.share => workflow.share(stage)?,
                    Some(sharing) if sharing.jobs.are_asked_for() => {
                        let replace = target.access()?.replace;
                        for (_, test) in workflow.tests() {
                            slurm(test, stage, &sharing.jobs, &replace)?;
                        }
                    }
                    _ => workflow.run(stage)?,
                }
                return Ok(ExitCode::SUCCESS);
            }
            let workflow = target.open(&file, threads)?;
            match sharing {
                Some(sharing) if sharing.share => workflow.share(stage)?,
                Some(sharing) if sharing.jobs.are_asked_for() => {
                    slurm(&workflow, stage, &sharing.jobs, &target.access()?.replace)?;
                }
                _ => workflow.run(stage)?,
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Parses a factor of at least 1.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor| (1.0..=1e6).contains(factor));
    factor.ok_or_else(|| "give a factor of at least 1 (recommended: 20)".to_owned())
}

/// Parses a length in mm, or 0.
fn length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|length| (0.0..=1e3).contains(length));
    length.ok_or_else(|| "give a length in mm, or 0".to_owned())
}

/// Returns the stage with this name.
fn stage_named(name: &str) -> Result<&'static Stage, WorkflowError> {
    Stage::named(name).ok_or_else(|| {
        let names: Vec<&str> = STAGES.iter().map(|stage| stage.name).collect();
        let help = format!("Name one of: {}.", names.join(", "));
        InputError::new(Path::new("--until"), name, "", "is no stage", help).into()
    })
}

/// Prints the state of a results folder; exit code 3 if there is unfinished work.
fn status(dir: &Path) -> Result<ExitCode, Failure> {
    let parts = match crate::study_status(dir)? {
        Some(parts) => parts,
        None => vec![PartStatus { name: String::new(), stages: crate::status(dir)? }],
    };
    for PartStatus { name, stages } in &parts {
        if !name.is_empty() {
            print_line(name)?;
        }
        for stage in stages {
            print_line(stage)?;
        }
    }
    let mut stages = parts.iter().flat_map(|part| &part.stages);
    Ok(if stages.all(StageStatus::is_done) { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

fn run_all(workflow: &Workflow<'_>) -> Result<(), Failure> {
    workflow.run_all()?;
    print_results(workflow.dir(), &["summary.txt", "map.csv", "confirm.csv"])
}

fn run_all_tests(mut workflow: JointWorkflow<'_>) -> Result<(), Failure> {
    workflow.run_all()?;
    print_results(workflow.dir(), &["summary.txt", "map.csv", "without_tests.csv"])
}

/// Prints the files `names` of a results folder, and the path of the report.
fn print_results(out: &Path, names: &[&str]) -> Result<(), Failure> {
    for name in names {
        let path = out.join(name);
        // imported runs cannot be confirmed
        if *name == "confirm.csv" && !path.exists() {
            continue;
        }
        let text = std::fs::read_to_string(&path)
            .map_err(|source| WorkflowError::Io { path: path.clone(), source })?;
        print_line(format_args!("{}:\n{text}", path.display()))?;
    }
    print_line(format_args!("report: {}", out.join("report.html").display()))
}
