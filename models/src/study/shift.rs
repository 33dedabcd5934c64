//! Runs laboratories and cases of a study concurrently, on the cores of one machine.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use super::file::{StudyCase, StudyFile, StudyLaboratory, StudySetting, truths};
use crate::case::{CaseFile, ExperimentsCase};
use crate::error::InputError;
use crate::progress::{say, speaking_for};
use crate::report::ComparedCase;
use crate::workflow::{Cores, FolderAccess, STAGES, Stage, Workflow, WorkflowError};

/// Stages that a laboratory runs.
pub(super) const TESTING: [&str; 3] = ["segment", "mesh", "experiments"];

/// Execution of all parts of a study.
pub(super) struct Shift<'a> {
    file: &'a StudyFile,
    dir: &'a Path,
    threads: usize,
    interrupt: &'a AtomicBool,
    /// Files of the user that the study may replace.
    replace: &'a [PathBuf],
    cores: Cores,
    /// Errors of parts, each with the rank of the part in the order of execution.
    failures: Mutex<Vec<(usize, WorkflowError)>>,
}

/// Results of the parts of a study.
pub(super) struct Finished {
    /// Cases that ended without an error, for each setting.
    pub(super) cases: Vec<Vec<ComparedCase>>,
    /// The first failure in the order of the file.
    pub(super) failure: Option<WorkflowError>,
}

/// Reports to the waiting cases whether the specimens of a laboratory are available. If the value is dropped after a
/// failure or a panic of the laboratory, the report is `false`.
struct Tested<'a>(&'a OnceLock<bool>);

impl Drop for Tested<'_> {
    fn drop(&mut self) {
        let _ = self.0.set(false);
    }
}

impl<'a> Shift<'a> {
    pub(super) fn new(
        file: &'a StudyFile,
        dir: &'a Path,
        threads: usize,
        interrupt: &'a AtomicBool,
        replace: &'a [PathBuf],
    ) -> Self {
        let (cores, failures) = (Cores::new(threads), Mutex::default());
        Self { file, dir, threads, interrupt, replace, cores, failures }
    }

    /// Runs everything that is not finished, and returns the data for the comparison of the cases.
    ///
    /// # Errors
    /// Only an interruption. Any other failure of a part does not stop the other parts; the first failure is returned
    /// in [`Finished`].
    pub(super) fn run(self) -> Result<Finished, WorkflowError> {
        let tested: Vec<Vec<OnceLock<bool>>> = self
            .file
            .settings
            .iter()
            .map(|setting| setting.laboratories.iter().map(|_| OnceLock::new()).collect())
            .collect();
        let settings = || self.file.settings.iter().zip(&tested);
        let shift = &self;
        let all = std::thread::scope(|scope| {
            let mut ranks = 0..;
            let mut next = || ranks.next().unwrap_or_default();
            for (setting, tested) in settings() {
                let names = setting.laboratory_folders();
                for ((laboratory, tested), name) in
                    setting.laboratories.iter().zip(tested).zip(names)
                {
                    let rank = next();
                    scope.spawn(move || {
                        let tested = Tested(tested);
                        let done = shift.part(rank, &name, || shift.test(rank, &name, laboratory));
                        let _ = tested.0.set(done.is_some());
                    });
                }
            }
            let begun: Vec<Vec<_>> = settings()
                .map(|(setting, tested)| {
                    let cases = setting.cases.iter().zip(setting.case_folders());
                    let begin = |(case, name): (&'a StudyCase, String)| {
                        let (rank, tested) = (next(), tested_for(setting, case, tested));
                        scope.spawn(move || {
                            shift.part(rank, &name, || {
                                if !tested.is_none_or(|tested| *tested.wait()) {
                                    if !shift.interrupt.load(Ordering::Relaxed) {
                                        say("omitted", "its laboratory has failed");
                                    }
                                    return Ok(None);
                                }
                                shift.calibrate(rank, &name, setting, case).map(Some)
                            })
                        })
                    };
                    cases.map(begin).collect()
                })
                .collect();
            let end = |case: std::thread::ScopedJoinHandle<'_, Option<Option<ComparedCase>>>| {
                case.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).flatten()
            };
            begun.into_iter().map(|cases| cases.into_iter().filter_map(end).collect()).collect()
        });
        let mut failures = self.failures.into_inner().unwrap_or_else(PoisonError::into_inner);
        let is_interruption = |error: &WorkflowError| matches!(error, WorkflowError::Interrupted);
        failures.sort_by_key(|(rank, error)| (!is_interruption(error), *rank));
        let failure = failures.into_iter().next().map(|(_, error)| error);
        match failure {
            Some(error) if is_interruption(&error) => Err(error),
            failure => Ok(Finished { cases: all, failure }),
        }
    }

    /// Runs only one part; a case only up to the stage `until`, if it is given.
    ///
    /// # Errors
    /// The error that ended the run, or a name that no part of the study has.
    pub(super) fn only(
        &self,
        name: &str,
        until: Option<&'static Stage>,
    ) -> Result<(), WorkflowError> {
        let mut folders: Vec<String> = Vec::new();
        for setting in &self.file.settings {
            for (laboratory, folder) in
                setting.laboratories.iter().zip(setting.laboratory_folders())
            {
                if folder == name {
                    return self.test(0, name, laboratory);
                }
                folders.push(folder);
            }
            for (case, folder) in setting.cases.iter().zip(setting.case_folders()) {
                if folder == name {
                    let file = with_specimens(self.dir, setting, case);
                    let workflow = self.open(0, name, &file)?;
                    let Some(last) = until else { return workflow.run_all() };
                    let before = STAGES.iter().take_while(|stage| stage.name != last.name);
                    return before.chain([last]).try_for_each(|stage| workflow.run(stage));
                }
                folders.push(folder);
            }
        }
        let help = format!("Name one of: {}.", folders.join(", "));
        Err(InputError::new(&self.file.path, "--only", name, "is not a part of the study", help)
            .into())
    }

    /// Runs `work` for a part. All messages of the work show the name of the part. A failure is reported immediately
    /// and stored.
    fn part<T>(
        &self,
        rank: usize,
        name: &str,
        work: impl FnOnce() -> Result<T, WorkflowError>,
    ) -> Option<T> {
        speaking_for(name, || match work() {
            Ok(done) => Some(done),
            Err(error) => {
                if !matches!(error, WorkflowError::Interrupted) {
                    say("failed", &error.to_string());
                }
                let mut failures = self.failures.lock().unwrap_or_else(PoisonError::into_inner);
                failures.push((rank, error));
                None
            }
        })
    }

    /// Runs the stages that test the specimens of a laboratory.
    fn test(
        &self,
        rank: usize,
        name: &str,
        laboratory: &StudyLaboratory,
    ) -> Result<(), WorkflowError> {
        let workflow = self.open(rank, name, &laboratory.file)?;
        TESTING
            .iter()
            .filter_map(|name| Stage::named(name))
            .try_for_each(|stage| workflow.run(stage))
    }

    /// Runs a case, and returns its data for the comparison.
    fn calibrate(
        &self,
        rank: usize,
        name: &str,
        setting: &StudySetting,
        case: &StudyCase,
    ) -> Result<ComparedCase, WorkflowError> {
        let file = with_specimens(self.dir, setting, case);
        let workflow = self.open(rank, name, &file)?;
        workflow.run_all()?;
        let mut results = workflow.results()?;
        let names: Vec<String> = file.case.prior.iter().flat_map(|prior| prior.names()).collect();
        let truths = truths(setting.laboratory(case), &file);
        for (parameter, name) in results.parameters.iter_mut().zip(&names) {
            parameter.truth = truths.get(name).copied();
        }
        let reference = names
            .iter()
            .map(|name| {
                let parameter = name.parse().ok()?;
                case.reference.map.get(&parameter).copied()
            })
            .collect();
        Ok(ComparedCase {
            name: case.name.clone(),
            specimens_from: specimens_from(&file),
            names,
            parameters: results.parameters,
            reference,
            qois: results.qois,
            densities: results.loo.into_iter().map(|one| (one.specimen, one.elpd)).collect(),
            evidence: results.evidence,
            reference_errors: case.reference.percent_error.clone(),
            warnings: results.warnings,
        })
    }

    fn open(
        &self,
        rank: usize,
        name: &str,
        file: &CaseFile,
    ) -> Result<Workflow<'a>, WorkflowError> {
        let dir = self.dir.join(name);
        let access = FolderAccess { reuse: false, replace: self.replace.to_vec() };
        let workflow = Workflow::open_with(file, &dir, self.threads, self.interrupt, &access)?;
        Ok(workflow.among(&self.cores, rank))
    }
}

/// Returns the flag for the availability of the laboratory's specimens, if the case uses a laboratory.
fn tested_for<'t>(
    setting: &StudySetting,
    case: &StudyCase,
    tested: &'t [OnceLock<bool>],
) -> Option<&'t OnceLock<bool>> {
    let named = case.laboratory.as_ref()?;
    let index = setting.laboratories.iter().position(|laboratory| laboratory.name == *named)?;
    tested.get(index)
}

/// Returns a text that identifies the specimens of a case: the path of their table and the name of their group, for
/// measured specimens and for specimens of a laboratory. `None` for a case with its own virtual specimens, which no
/// other case shares.
fn specimens_from(file: &CaseFile) -> Option<String> {
    let experiments = file.case.experiments.as_ref()?;
    let group = experiments.group.as_deref().unwrap_or_default();
    let table = experiments.table.as_ref().or(experiments.values.as_ref());
    table.map(|table| format!("{} {group}", table.display()))
}

/// Returns the case; if it belongs to a laboratory, the specimens of the laboratory replace the experiments of the
/// case.
pub(super) fn with_specimens(dir: &Path, setting: &StudySetting, case: &StudyCase) -> CaseFile {
    let mut file = case.file.clone();
    if let Some(laboratory) = setting.laboratory(case) {
        let folder = dir.join(setting.laboratory_folder(laboratory));
        let table = folder.join("experiments/specimens.csv");
        file.case.experiments = Some(experiments_in(Some(table), &file));
    }
    file
}

/// `[experiments]` of a case whose specimens are tested in a laboratory and are listed in `table`.
pub(super) fn experiments_in(table: Option<PathBuf>, file: &CaseFile) -> ExperimentsCase {
    ExperimentsCase {
        table,
        values: None,
        group: None,
        test: None,
        toe: file.case.experiments.as_ref().map(|e| e.toe).unwrap_or_default(),
        read: None,
        virtual_specimens: None,
    }
}
