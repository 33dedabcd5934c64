//! The command line: parsing of arguments, commands, and the final output.

mod arguments;
mod check;
mod cluster;
mod failure;
mod init;
mod interrupt;
mod output;
mod prony;
mod ranks;
mod replace;
mod request;
mod results;

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use fem::Ranks;

use crate::case::schema_of;
use crate::study::study_schema;
use crate::workflow::{SurfaceOptions, check_begun, detach, simulate};
use crate::{
    Case, CaseFile, InputError, Registry, STAGES, Stage, Study, StudyFile, Workflow, WorkflowError,
};
use arguments::{Command, FileKind, StudyAction};
use check::check;
use cluster::{slurm, slurm_study};
use failure::Failure;
use init::{init, init_own_data};
use interrupt::{INTERRUPT, handle_signals};
use output::print_line;
use prony::prony;
use replace::replaceable;
use request::{Request, request};
use results::{run_all, run_all_tests, status};

/// Stages that read results of other stages: they do not create a results folder.
const NEED_RESULTS: [&str; 7] =
    ["surrogate", "calibrate", "confirm", "validate", "verdict", "next-test", "report"];

/// Runs the program. Exit codes: 0 if everything is complete, 1 after an error, 2 for an invalid command line, 3 if
/// `status` finds unfinished work, 130 after Ctrl-C or another signal to end.
///
/// `registry` contains the quantities of interest and the parameters that cases can name: the entries of
/// [`Registry::standard`], and the extensions of the user's program.
pub fn program(registry: Registry) -> ExitCode {
    registry.install();
    let (threads, request) = request();
    handle_signals();
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

/// Returns the ranks that execute the request; only `simulate` can run on several ranks.
fn ranks_of(request: &Request) -> Result<Ranks, Failure> {
    let command = match request {
        Request::Command(Command::Simulate { .. }) => return ranks::ranks(),
        Request::Default | Request::Command(Command::Run(_)) => "run",
        Request::Command(Command::Init { .. }) => "init",
        Request::Command(Command::Check { .. }) => "check",
        Request::Command(Command::Schema { .. }) => "schema",
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
        Request::Command(Command::Schema { kind }) => {
            let schema = match kind {
                FileKind::Case => schema_of::<Case>("Breccia case"),
                FileKind::Study => study_schema(),
            };
            print_line(format_args!("{schema:#}"))?;
        }
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
            let path = simulate(&file, &target.out, device, ranks, &INTERRUPT, &access)?;
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
        Request::Command(Command::Study { action: Some(action), .. }) => {
            let StudyAction::Detach { case, dest } = action;
            detach(&case, &dest)?;
            print_line(dest.display())?;
        }
        Request::Command(Command::Study { file, out, set, replace, only, until, jobs, .. }) => {
            let path = file.unwrap_or_default();
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
            if NEED_RESULTS.contains(&stage.name) {
                check_begun(&target.out, stage)?;
            }
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

/// Returns the stage with this name.
fn stage_named(name: &str) -> Result<&'static Stage, WorkflowError> {
    Stage::named(name).or_else(|| Stage::formerly_named(name)).ok_or_else(|| {
        let names: Vec<&str> = STAGES.iter().map(|stage| stage.name).collect();
        let help = format!("Name one of: {}.", names.join(", "));
        InputError::new(Path::new("--until"), name, "", "is not a stage", help).into()
    })
}
