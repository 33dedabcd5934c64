//! The source `[simulator]`: a program of the user that computes each run in a separate folder.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use fem::{End, EnsembleState, FemError, Outcome, RunInput, RunRecord, RunStatus};

use super::process::{ProcessEnd, run_process};
use super::result_file::{ProgramResult, read_result};
use crate::case::{SimulatorCase, Template, Value};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::run_key::RunKey;
use crate::results_folder::error::WorkflowError;
use crate::runs::ensemble_runs::{folder_of_runs, run_jobs};
use crate::runs::run_source::{RequestedRuns, RunSource};

/// Subfolder of an ensemble with the folders in which the program works.
const FOLDER: &str = "work";
/// Error code of Unix for a file that is no program of this machine (ENOEXEC).
const NO_PROGRAM: i32 = 8;

/// File with everything that the program prints.
const OUTPUT: &str = "program-output.txt";

/// Number of characters of the program's last line in a message.
const LINE: usize = 200;

/// The program of a case with its files.
struct Program {
    case: SimulatorCase,
    /// Name and template of the input file.
    input: Option<(String, Template)>,
    arguments: Vec<Template>,
    /// Names and contents of the further files.
    files: Vec<(String, Vec<u8>)>,
}

/// Keys of `[simulator]` that change the result of a run.
const KEYS_OF_RUNS: [&str; 4] =
    ["simulator.command", "simulator.input", "simulator.files", "simulator.result"];

/// Opens the source, if the case has `[simulator]`.
///
/// # Errors
/// Fails if a file of the simulator cannot be read.
pub(super) fn open(inputs: &Inputs<'_>) -> Result<Option<Box<dyn RunSource>>, WorkflowError> {
    let Some(case) = inputs.unrecorded_simulator() else { return Ok(None) };
    KEYS_OF_RUNS.iter().for_each(|key| inputs.reads(key));
    let read = |path: &Path| {
        let file = inputs.named_file(path);
        fem::read_regular(&file).map_err(|e| WorkflowError::io(&file, e))
    };
    let input = case.input.as_ref().map(|path| {
        let text = String::from_utf8_lossy(&read(path)?).into_owned();
        Ok::<_, WorkflowError>((name_of(path), Template::parse(&text)))
    });
    let mut case = case.clone();
    // the program works in another folder; a program without a folder is searched in PATH
    if Path::new(&case.command[0]).components().count() > 1 {
        let from = inputs.case_path().with_file_name("").join(&case.command[0]);
        let program = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
        case.command[0] = program.display().to_string();
    }
    let files = case.files.iter().map(|path| Ok((name_of(path), read(path)?)));
    Ok(Some(Box::new(Program {
        input: input.transpose()?,
        arguments: case.command[1..].iter().map(|word| Template::parse(word)).collect(),
        files: files.collect::<Result<_, WorkflowError>>()?,
        case,
    })))
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

impl RunSource for Program {
    fn identified(&self, key: RunKey, inputs: &Inputs<'_>) -> RunKey {
        let named = self.case.input.iter().chain(&self.case.files);
        let files: Vec<_> = named.map(|path| path.to_string_lossy()).collect();
        key.and(inputs, &KEYS_OF_RUNS, &files.iter().map(|name| &**name).collect::<Vec<_>>())
    }

    fn read_rest(&self, inputs: &Inputs<'_>) {
        // time limit and number of attempts decide which runs fail, but do not change a finished run
        inputs.simulator();
    }

    fn records(&self, requested: &RequestedRuns<'_>) -> Result<Vec<RunRecord>, WorkflowError> {
        let RequestedRuns { task, named, .. } = requested;
        let program = self.case.command[0].as_str();
        // with `interrupt` set, another machine may compute the runs
        if task.check_interrupt().is_ok() {
            check_program(task.inputs.case_path(), program).map_err(WorkflowError::Unusable)?;
        }
        let case_path = task.inputs.case_path();
        let (names, interrupt) = (named.names, task.interrupt);
        let limits = self.limits();
        // compute runs again that failed under other limits
        let retry = {
            let limits = limits.clone();
            move |record: &RunRecord| match &record.status {
                RunStatus::Failed(reason) => !reason.ends_with(&limits),
                RunStatus::Finished => false,
            }
        };
        let folder =
            folder_of_runs(&task.path(""), task.neighbours.as_ref(), named.folder, named.key);
        let succeeded = EnsembleState::of(&folder)
            .is_ok_and(|state| state.records.iter().any(|run| run.status == RunStatus::Finished));
        let first = FirstFailures::new(named.runs, succeeded);
        run_jobs(task, *named, Some(Box::new(retry)), &|run, folder, _| {
            let mut last = String::new();
            for _ in 0..=self.case.retries {
                match self.attempt(names, run, folder, interrupt) {
                    Ok(Some(ProgramResult { curve, values })) => {
                        first.succeed();
                        return Ok(Outcome { curve, values, ..Outcome::default() });
                    }
                    Ok(None) => return Ok(Outcome { end: End::Interrupted, ..Outcome::default() }),
                    Err(AttemptError::ThisRun(reason)) => last = reason,
                    Err(AttemptError::EveryRun(reason)) => {
                        let message = format!("{}: {reason}", case_path.display());
                        return Err(FemError::FailsInEveryRun(message));
                    }
                }
            }
            if first.fail(run.id) {
                return Err(FemError::FailsInEveryRun(format!(
                    "{}: simulator.command: all of the first {FIRST} runs have failed. Run {}: {last}{limits}. Run the \
                     program in its folder by hand, and correct simulator.command, the input file or time_limit_s",
                    case_path.display(),
                    run.id
                )));
            }
            Err(FemError::OtherProgram(format!("{last}{limits}")))
        })
    }
}

impl Program {
    /// Returns a description of the limits of a run, which is appended to the reason of a failed
    /// run.
    fn limits(&self) -> String {
        let attempts = match self.case.retries {
            0 => "1 attempt".to_owned(),
            more => format!("{} attempts", more + 1),
        };
        match self.case.time_limit_s {
            Some(limit) => format!(" ({attempts} of at most {limit} s)"),
            None => format!(" ({attempts})"),
        }
    }

    /// Runs the program once. Returns `None` if the program was interrupted.
    ///
    /// # Errors
    /// If the program cannot be started, or if the attempt has no result.
    fn attempt(
        &self,
        names: &[String],
        run: &RunInput,
        folder: &Path,
        interrupt: &AtomicBool,
    ) -> Result<Option<ProgramResult>, AttemptError> {
        let work = new_folder(&folder.join(FOLDER), run.id)?;
        let value = |name: &str| match name {
            "run" => Some(Value::Text(run.id.to_string())),
            "input" => self.input.as_ref().map(|(name, _)| Value::Text(name.clone())),
            _ => {
                let index = names.iter().position(|input_name| input_name == name)?;
                Some(Value::Number(run.inputs[index]))
            }
        };
        for (name, content) in &self.files {
            write(&work.join(name), content)?;
        }
        if let Some((name, template)) = &self.input {
            write(&work.join(name), template.render(&value).as_bytes())?;
        }
        let mut command = Command::new(&self.case.command[0]);
        command.args(self.arguments.iter().map(|word| word.render(&value))).current_dir(&work);
        let path = work.join(OUTPUT);
        let output = || fs::File::options().create(true).append(true).open(&path);
        let output = output().and_then(|out| Ok((out.try_clone()?, out)));
        let (out, errors) = output.map_err(|e| format!("cannot write {}: {e}", path.display()))?;
        command.stdout(out).stderr(errors);
        let limit = self.case.time_limit_s.map(Duration::from_secs_f64);
        let end = run_process(command, limit, interrupt)
            .map_err(|source| AttemptError::of_start(&self.case.command[0], &source))?;
        let folder_name = shown(&work, folder);
        match end {
            ProcessEnd::Interrupted => Ok(None),
            ProcessEnd::TimeLimit => {
                let limit = self.case.time_limit_s.unwrap_or_default();
                Err(format!("stopped at the time limit of {limit} s, in {folder_name}").into())
            }
            ProcessEnd::Exited(status) if !status.success() => {
                let line = last_line(&path);
                Err(format!("the program ended with {status}{line}, in {folder_name}").into())
            }
            ProcessEnd::Exited(_) => {
                let result = work.join(&self.case.result);
                if !result.is_file() {
                    let (name, line) = (&self.case.result, last_line(&path));
                    let reason =
                        format!("the program has not written {name}{line}, in {folder_name}");
                    return Err(reason.into());
                }
                Ok(Some(read_result(&result).map_err(|error| error.to_string())?))
            }
        }
    }
}

/// Number of runs at the start of the list that must not all fail.
const FIRST: usize = 5;

/// Failures of the first runs of an ensemble.
struct FirstFailures<'a> {
    /// The first [`FIRST`] runs; empty if there are fewer runs.
    first: &'a [RunInput],
    failed: AtomicUsize,
    /// Whether a run has succeeded, in this process or earlier.
    succeeded: AtomicBool,
}

impl<'a> FirstFailures<'a> {
    fn new(runs: &'a [RunInput], succeeded: bool) -> Self {
        let first = runs.get(..FIRST).unwrap_or_default();
        Self { first, failed: AtomicUsize::new(0), succeeded: AtomicBool::new(succeeded) }
    }

    fn succeed(&self) {
        self.succeeded.store(true, Ordering::Relaxed);
    }

    /// Counts a failed run. Returns whether all of the first runs have failed and no run has succeeded.
    fn fail(&self, id: usize) -> bool {
        if self.first.iter().all(|run| run.id != id) {
            return false;
        }
        let failed = self.failed.fetch_add(1, Ordering::Relaxed) + 1;
        failed >= FIRST && !self.succeeded.load(Ordering::Relaxed)
    }
}

/// Reason why an attempt has no result.
enum AttemptError {
    /// Reason that concerns this run only.
    ThisRun(String),
    /// Reason that every run shares, with its remedy.
    EveryRun(String),
}

impl AttemptError {
    /// Error of the operating system at the start of `program`. Other errors, such as a lack of memory, processes or open
    /// files, may be temporary.
    fn of_start(program: &str, source: &io::Error) -> Self {
        let help = if source.kind() == ErrorKind::NotFound {
            "write the path of the program; the interpreter in the first line of a script must exist too".to_owned()
        } else if source.kind() == ErrorKind::PermissionDenied {
            format!(
                "make the file executable (chmod +x {program}), or write its interpreter before it: [\"sh\", …]"
            )
        } else if source.raw_os_error() == Some(NO_PROGRAM) {
            "name a program for this machine, or write its interpreter before it: [\"sh\", …]"
                .to_owned()
        } else {
            return Self::ThisRun(format!("the program cannot be started: {source}"));
        };
        Self::EveryRun(format!(
            "simulator.command = {program:?}: the program cannot be started: {source}; {help}"
        ))
    }
}

impl From<String> for AttemptError {
    fn from(reason: String) -> Self {
        Self::ThisRun(reason)
    }
}

/// Creates an empty folder for an attempt: `run-007`, then `run-007-2` and so on. Existing folders are kept.
fn new_folder(parent: &Path, run: usize) -> Result<PathBuf, String> {
    let failed = |path: &Path, e: std::io::Error| format!("cannot create {}: {e}", path.display());
    fs::create_dir_all(parent).map_err(|e| failed(parent, e))?;
    for attempt in 1_usize.. {
        let more = if attempt == 1 { String::new() } else { format!("-{attempt}") };
        let folder = parent.join(format!("run-{run:03}{more}"));
        match fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) => return Err(failed(&folder, e)),
        }
    }
    Err("no free name for a folder".to_owned())
}

fn write(path: &Path, content: &[u8]) -> Result<(), String> {
    fs::write(path, content).map_err(|e| format!("cannot write {}: {e}", path.display()))
}

/// Returns the path of the folder `work` of a run, relative to the results folder.
fn shown(work: &Path, ensemble: &Path) -> String {
    let root = ensemble.parent().and_then(Path::parent).unwrap_or(ensemble);
    work.strip_prefix(root).unwrap_or(work).display().to_string()
}

/// The last line that the program has printed, as part of a message; empty if there is none.
fn last_line(path: &Path) -> String {
    let Ok(bytes) = fs::read(path) else { return String::new() };
    let text = String::from_utf8_lossy(&bytes);
    let line = text.lines().rev().map(str::trim).find(|line| !line.is_empty());
    line.map_or_else(String::new, |line| {
        let short: String = line.chars().take(LINE).collect();
        format!("; its last line: {short}")
    })
}

/// Checks that the program of a case exists on this machine.
///
/// # Errors
/// A message with the program and the remedy.
pub(crate) fn check_program(case: &Path, program: &str) -> Result<(), String> {
    if is_found(program) {
        return Ok(());
    }
    Err(format!(
        "{}: simulator.command = {program:?}: there is no such program on this machine; write its path, or add \
         its folder to PATH",
        case.display()
    ))
}

/// Whether a program exists: at its path, or for a plain name in a folder of `PATH`.
fn is_found(program: &str) -> bool {
    let path = Path::new(program);
    if path.components().count() > 1 {
        return path.is_file();
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&folders).collect();
    let endings = ["", std::env::consts::EXE_SUFFIX];
    folders.iter().any(|folder| {
        endings.iter().any(|ending| folder.join(format!("{program}{ending}")).is_file())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(count: usize) -> Vec<RunInput> {
        (1..=count).map(|id| RunInput { id, inputs: Vec::new() }).collect()
    }

    #[test]
    fn an_ensemble_ends_if_all_of_its_first_runs_fail() {
        let all = runs(20);
        let failing = FirstFailures::new(&all, false);
        // failures of later runs do not count, even if these runs fail first
        let ends: Vec<bool> = [9, 1, 2, 10, 4, 3, 5].map(|id| failing.fail(id)).to_vec();
        assert_eq!(ends, [false, false, false, false, false, false, true]);
        let mixed = FirstFailures::new(&all, false);
        assert!(!mixed.fail(1));
        mixed.succeed();
        assert!((2..=20).all(|id| !mixed.fail(id)));
        let resumed = FirstFailures::new(&all, true);
        assert!((1..=20).all(|id| !resumed.fail(id)));
        // a stage with fewer runs, such as `confirm`, does not end
        let few = runs(3);
        let few = FirstFailures::new(&few, false);
        assert!((1..=3).all(|id| !few.fail(id)));
    }
}
