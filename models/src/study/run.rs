//! Running a study: its laboratories, its cases, and what they say together.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::compare::agreement;
use super::file::{LABORATORIES, StudyCase, StudyFile, truths};
use crate::case::{CaseFile, ExperimentsCase};
use crate::progress::say;
use crate::report::{CalibratedParameter, ComparedCase, Pair, StudyResults, study_page};
use crate::table::to_csv;
use crate::workflow::{Stage, StageStatus, Workflow, WorkflowError, status};

/// Which folders belong to a study: what [`study_status`] reads.
const PARTS: &str = "study.toml";

/// Stages that a laboratory takes.
const TESTING: [&str; 3] = ["segment", "mesh", "experiments"];

/// The names of the parts of a study, in order.
#[derive(serde::Serialize, serde::Deserialize)]
struct Parts {
    laboratories: Vec<String>,
    cases: Vec<String>,
}

/// A study being worked on in a directory.
#[derive(Debug)]
pub struct Study<'a> {
    file: StudyFile,
    dir: PathBuf,
    threads: usize,
    interrupt: &'a AtomicBool,
}

impl<'a> Study<'a> {
    /// A study whose results are written to `dir`: a folder a case, named as it.
    ///
    /// # Errors
    /// A directory that cannot be made.
    pub fn open(
        file: StudyFile,
        dir: &Path,
        threads: usize,
        interrupt: &'a AtomicBool,
    ) -> Result<Self, WorkflowError> {
        // what cases take from a laboratory is named from their own folders
        let dir = std::path::absolute(dir).map_err(|e| WorkflowError::results(dir, e))?;
        std::fs::create_dir_all(&dir).map_err(|e| WorkflowError::results(&dir, e))?;
        let study = Self { file, dir, threads, interrupt };
        let parts = Parts {
            laboratories: study.file.laboratories.iter().map(|l| l.name.clone()).collect(),
            cases: study.file.cases.iter().map(|case| case.name.clone()).collect(),
        };
        let text = toml::to_string(&parts).expect("names are plain text");
        study.write(PARTS, text.as_bytes())?;
        Ok(study)
    }

    /// Runs all that is not finished: specimens are tested, each case is calibrated, and `study.csv` and
    /// `report.html` say what they show together. A case that fails leaves the others going on.
    ///
    /// # Errors
    /// What ended a laboratory; of cases that failed the first one's, after the others have been run.
    pub fn run(&self) -> Result<(), WorkflowError> {
        for laboratory in &self.file.laboratories {
            say("laboratory", &laboratory.name);
            let dir = self.dir.join(LABORATORIES).join(&laboratory.name);
            let workflow = Workflow::open(&laboratory.file, &dir, self.threads, self.interrupt)?;
            for stage in TESTING.iter().filter_map(|name| Stage::named(name)) {
                workflow.run(stage)?;
            }
        }
        let mut failed = None;
        let mut done = Vec::new();
        for case in &self.file.cases {
            say("case", &case.name);
            match self.calibrated(case) {
                Ok(compared) => done.push(compared),
                Err(WorkflowError::Interrupted) => return Err(WorkflowError::Interrupted),
                Err(error) => {
                    say("failed", &format!("{}: {error}", case.name));
                    failed.get_or_insert(error);
                }
            }
        }
        if let Some(error) = failed {
            return Err(error);
        }
        self.conclude(done)
    }

    /// Runs a case, and takes from it what is compared.
    fn calibrated(&self, case: &StudyCase) -> Result<ComparedCase, WorkflowError> {
        let file = self.with_specimens(case);
        let dir = self.dir.join(&case.name);
        let workflow = Workflow::open(&file, &dir, self.threads, self.interrupt)?;
        workflow.run_all()?;
        let mut results = workflow.results()?;
        let names: Vec<String> = file.case.prior.iter().flat_map(|prior| prior.names()).collect();
        let truths = truths(self.file.laboratory(case), &file);
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
            names,
            parameters: results.parameters,
            reference,
            qois: results.qois,
            reference_errors: case.reference.percent_error.clone(),
            warnings: results.warnings,
        })
    }

    /// The case with the specimens of its laboratory in place of its own.
    fn with_specimens(&self, case: &StudyCase) -> CaseFile {
        let mut file = case.file.clone();
        if let Some(laboratory) = &case.laboratory {
            let folder = self.dir.join(LABORATORIES).join(laboratory);
            let toe = file.case.experiments.as_ref().map(|e| e.toe).unwrap_or_default();
            file.case.experiments = Some(ExperimentsCase {
                table: Some(folder.join("experiments/specimens.csv")),
                group: None,
                toe,
                virtual_specimens: None,
            });
        }
        file
    }

    /// Writes what the cases say together.
    fn conclude(&self, cases: Vec<ComparedCase>) -> Result<(), WorkflowError> {
        let header = ["case", "parameter", "map", "mean", "sd", "q05", "q95", "truth"];
        let rows = cases.iter().flat_map(|case| {
            case.names.iter().zip(&case.parameters).map(|(name, p)| {
                let numbers = [p.map, p.mean.0, p.sd.0, p.q05.0, p.q95.0].map(|x| x.to_string());
                let truth = p.truth.map(|truth| truth.to_string()).unwrap_or_default();
                [case.name.clone(), name.clone()].into_iter().chain(numbers).chain([truth])
            })
        });
        let table =
            to_csv(header, rows).map_err(|e| WorkflowError::io(&self.dir.join("study.csv"), e))?;
        self.write("study.csv", &table)?;
        let results = StudyResults {
            title: self.file.title.clone(),
            pairs: pairs(&cases),
            cases,
            text: self.file.text.clone(),
        };
        self.write("report.html", study_page(&results).as_bytes())?;
        say("study", &self.dir.join("report.html").display().to_string());
        Ok(())
    }

    fn write(&self, name: &str, content: &[u8]) -> Result<(), WorkflowError> {
        let path = self.dir.join(name);
        if std::fs::read(&path).is_ok_and(|now| now == content) {
            return Ok(());
        }
        fem::write_atomically(&path, content).map_err(|e| WorkflowError::io(&path, e))
    }

    /// The directory of the results.
    pub fn dir(&self) -> &Path {
        &self.dir
    }
}

/// Every two cases beside each other, parameter by parameter that both have.
fn pairs(cases: &[ComparedCase]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (i, a) in cases.iter().enumerate() {
        for b in &cases[i + 1..] {
            for (name, p) in a.names.iter().zip(&a.parameters) {
                let Some(at) = b.names.iter().position(|other| other == name) else { continue };
                let draws = |p: &CalibratedParameter| p.draws().collect::<Vec<_>>();
                let found = agreement(&draws(p), &draws(&b.parameters[at]));
                pairs.push(Pair {
                    cases: [a.name.clone(), b.name.clone()],
                    label: p.label.clone(),
                    overlap: found.overlap,
                    ratio: found.ratio,
                });
            }
        }
    }
    pairs
}

/// How far a laboratory or a case of a study has come.
#[derive(Clone, Debug, PartialEq)]
pub struct PartStatus {
    /// Its folder.
    pub name: String,
    /// Its stages.
    pub stages: Vec<StageStatus>,
}

/// How far each part of a study has come, in order. Nothing if the folder is none of a study.
///
/// # Errors
/// A part that cannot be read.
pub fn study_status(dir: &Path) -> Result<Option<Vec<PartStatus>>, WorkflowError> {
    let Ok(text) = std::fs::read_to_string(dir.join(PARTS)) else { return Ok(None) };
    let Ok(parts) = toml::from_str::<Parts>(&text) else { return Ok(None) };
    let laboratories = parts.laboratories.iter().map(|name| (name, true));
    let cases = parts.cases.iter().map(|name| (name, false));
    let of = |(name, is_laboratory): (&String, bool)| {
        let place = if is_laboratory { format!("{LABORATORIES}/{name}") } else { name.clone() };
        let mut stages = match status(&dir.join(&place)) {
            Ok(stages) => stages,
            // it has not begun
            Err(WorkflowError::NoResults { .. }) => StageStatus::none(),
            Err(error) => return Err(error),
        };
        if is_laboratory {
            stages.retain(|stage| TESTING.contains(&stage.stage));
        }
        Ok(PartStatus { name: place, stages })
    };
    laboratories.chain(cases).map(of).collect::<Result<_, _>>().map(Some)
}
