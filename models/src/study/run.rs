//! Runs a study: its laboratories, its cases, and their comparison.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::compare::agreement;
use super::contradiction::contradictions;
use super::file::{StudyFile, StudySetting};
use super::shift::{Shift, with_specimens};
use super::slurm_study::StudyPart;
use super::status::{PartStatus, study_status};
use crate::case::CaseFile;
use crate::progress::say;
use crate::report::{CalibratedParameter, ComparedCase, Pair, StudyResults, Variant, study_page};
use crate::table::to_csv;
use crate::workflow::{FolderAccess, ProductFolder, Stage, Together, Workflow, WorkflowError};

/// A study and its results folder.
#[derive(Debug)]
pub struct Study<'a> {
    file: StudyFile,
    dir: PathBuf,
    threads: usize,
    interrupt: &'a AtomicBool,
    /// Files of the user that the study may replace.
    replace: Vec<PathBuf>,
}

/// Name of the command that writes the files of a study.
const COMMAND: &str = "study";

impl<'a> Study<'a> {
    /// Opens a study whose results are written to `dir`, with one folder per case, named after the case. The files
    /// `replace` of the user (absolute paths) may be replaced.
    ///
    /// # Errors
    /// If the directory cannot be created, or a file of the user has the path of a file that a study writes.
    pub fn open(
        file: StudyFile,
        dir: &Path,
        threads: usize,
        interrupt: &'a AtomicBool,
        replace: &[PathBuf],
    ) -> Result<Self, WorkflowError> {
        // the path is absolute, because cases refer to files of a laboratory from their own folders
        let dir = std::path::absolute(dir).map_err(|e| WorkflowError::results(dir, e))?;
        std::fs::create_dir_all(&dir).map_err(|e| WorkflowError::results(&dir, e))?;
        let all = || file.settings.iter();
        let laboratories = all().flat_map(|setting| setting.laboratory_folders()).collect();
        let cases = all().flat_map(|setting| setting.case_folders()).collect();
        Together::check_study(&file.path, &dir)?;
        let folder = ProductFolder::new(&dir, replace);
        for setting in &file.settings {
            let names = ["study.csv", "report.html"].map(|name| setting.within(name));
            names.iter().try_for_each(|name| folder.claim(name, COMMAND))?;
        }
        Together { laboratories, cases }.write(&dir, &folder)?;
        Ok(Self { file, dir, threads, interrupt, replace: replace.to_vec() })
    }

    /// Runs everything that is not finished: tests specimens, calibrates each case, and writes the comparison to
    /// `study.csv` and `report.html`. Laboratories and cases run concurrently and share the cores; with few cores,
    /// they run in the order of the file. A failing part does not stop the other parts; the comparison omits the
    /// failing part.
    ///
    /// # Errors
    /// The first failure in the order of the file, after all other parts have been run.
    pub fn run(&self) -> Result<(), WorkflowError> {
        let all = self.shift().run()?;
        self.compare(all.cases)?;
        all.failure.map_or(Ok(()), Err)
    }

    /// Runs only one laboratory or one case; a case only up to the stage `until`, if it is given.
    ///
    /// # Errors
    /// The error that ended the run, or a name that no part of the study has.
    pub fn run_part(&self, name: &str, until: Option<&'static Stage>) -> Result<(), WorkflowError> {
        self.shift().only(name, until)
    }

    fn shift(&self) -> Shift<'_> {
        Shift::new(&self.file, &self.dir, self.threads, self.interrupt, &self.replace)
    }

    /// Writes the case of each part into its folder, and returns the status of each part, laboratories first.
    ///
    /// # Errors
    /// If a folder contains the results of another case, or cannot be written.
    pub fn prepare(&self) -> Result<Vec<StudyPart>, WorkflowError> {
        let opened = |file: &CaseFile, name: &str| {
            let dir = self.dir.join(name);
            let access = FolderAccess { reuse: false, replace: self.replace.clone() };
            Workflow::open_with(file, &dir, self.threads, self.interrupt, &access).map(drop)
        };
        let mut laboratories_of = Vec::new();
        for setting in &self.file.settings {
            for (laboratory, name) in setting.laboratories.iter().zip(setting.laboratory_folders())
            {
                opened(&laboratory.file, &name)?;
            }
            for (case, name) in setting.cases.iter().zip(setting.case_folders()) {
                opened(&with_specimens(&self.dir, setting, case), &name)?;
                let laboratory = setting.laboratory(case);
                laboratories_of.push((name, laboratory.map(|l| setting.laboratory_folder(l))));
            }
        }
        let part = |status: PartStatus| {
            let case = laboratories_of.iter().find(|(name, _)| *name == status.name);
            StudyPart { case: case.map(|(_, laboratory)| laboratory.clone()), status }
        };
        let study_parts = study_status(&self.dir)?.unwrap_or_default();
        Ok(study_parts.into_iter().map(part).collect())
    }

    /// Writes the comparison of the cases under each setting.
    fn compare(&self, all: Vec<Vec<ComparedCase>>) -> Result<(), WorkflowError> {
        let settings = &self.file.settings;
        let compared = |(setting, cases): (&StudySetting, Vec<ComparedCase>)| {
            let is_there = |name: &String| cases.iter().any(|case| case.name == *name);
            let names = setting.cases.iter().map(|case| case.name.clone());
            let results = StudyResults {
                title: setting.title.clone(),
                missing: names.filter(|name| !is_there(name)).collect(),
                pairs: pairs(&cases),
                cases,
                text: self.file.text.clone(),
                ..StudyResults::default()
            };
            StudyResults { contradictions: contradictions(&results), ..results }
        };
        let mut results: Vec<StudyResults> = settings.iter().zip(all).map(compared).collect();
        if results.len() > 1 {
            let variant = |(setting, results): (&StudySetting, &StudyResults)| Variant {
                title: setting.title.clone(),
                folder: setting.folder.clone(),
                cases: results.cases.clone(),
                missing: results.missing.clone(),
            };
            results[0].variants = settings.iter().zip(&results).skip(1).map(variant).collect();
        }
        for (setting, results) in settings.iter().zip(&results) {
            let of_whom =
                if settings.len() > 1 { format!("{}: ", setting.title) } else { String::new() };
            for text in &results.contradictions {
                say("warning", &format!("{of_whom}{text}"));
            }
            let folder = ProductFolder::new(&self.dir, &self.replace);
            let [table, page] = ["study.csv", "report.html"].map(|name| setting.within(name));
            folder.write(
                &table,
                COMMAND,
                &comparison_csv(&folder.path(&table), &results.cases)?,
            )?;
            folder.write(&page, COMMAND, study_page(results).as_bytes())?;
            say("study", &folder.path(&page).display().to_string());
        }
        Ok(())
    }

    /// The directory of the results.
    pub fn dir(&self) -> &Path {
        &self.dir
    }
}

/// Contents of `study.csv`.
fn comparison_csv(file: &Path, cases: &[ComparedCase]) -> Result<Vec<u8>, WorkflowError> {
    let header = ["case", "parameter", "map", "mean", "sd", "q05", "q95", "truth"];
    let rows = cases.iter().flat_map(|case| {
        case.names.iter().zip(&case.parameters).map(|(name, p)| {
            let statistics = [p.map, p.mean.0, p.sd.0, p.q05.0, p.q95.0].map(|x| x.to_string());
            let truth = p.truth.map(|truth| truth.to_string()).unwrap_or_default();
            [case.name.clone(), name.clone()].into_iter().chain(statistics).chain([truth])
        })
    });
    to_csv(header, rows).map_err(|e| WorkflowError::io(file, e))
}

/// Compares all pairs of cases in all parameters that both cases have.
fn pairs(cases: &[ComparedCase]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (i, a) in cases.iter().enumerate() {
        for b in &cases[i + 1..] {
            for (name, p) in a.names.iter().zip(&a.parameters) {
                let Some(at) = b.names.iter().position(|other| other == name) else { continue };
                let draws = |p: &CalibratedParameter| p.draws().collect::<Vec<_>>();
                let comparison = agreement(&draws(p), &draws(&b.parameters[at]));
                pairs.push(Pair {
                    cases: [a.name.clone(), b.name.clone()],
                    label: p.label.clone(),
                    overlap: comparison.overlap,
                    ratio: comparison.ratio,
                });
            }
        }
    }
    pairs
}
