//! Checks the input of a study: reports all mistakes of all parts, without computing or writing anything.

use std::path::Path;

use super::file::{ReadStudy, StudyFile, StudyMistake, StudySetting};
use super::shift::experiments_in;
use crate::case::CaseFile;
use crate::error::InputError;
use crate::workflow::{CaseCheck, ExpectedCost};

/// Largest number of parts that are named in one message.
const NAMED: usize = 3;

/// Result of the check of a study.
#[derive(Clone, Debug, Default)]
pub struct StudyCheck {
    /// Interpreted input that all parts of the study share: subject and text of each line.
    pub understood: Vec<(&'static str, String)>,
    /// Laboratories and cases of each setting, with the interpreted input that differs between parts.
    pub parts: Vec<PartCheck>,
    /// Notes for the user, with the names of the parts concerned.
    pub notes: Vec<String>,
    /// Warnings: findings that may make results wrong, with the names of the parts concerned.
    pub warnings: Vec<String>,
    /// Errors that would prevent a run, with the names of the parts concerned.
    pub mistakes: Vec<String>,
}

/// Interpreted input of one laboratory or case of a study.
#[derive(Clone, Debug)]
pub struct PartCheck {
    /// Folder of the part within the folder of the study.
    pub folder: String,
    /// Subject and text of each line.
    pub understood: Vec<(&'static str, String)>,
}

/// Messages in order of first occurrence, each with the names of the parts concerned.
#[derive(Default)]
struct Concerning(Vec<(String, Vec<String>)>);

impl StudyCheck {
    /// Whether a file is a study; false if the file cannot be read.
    pub fn is_study(path: &Path) -> bool {
        CaseFile::text(path).is_ok_and(|text| CaseFile::is_study(&text))
    }

    /// Reads a study and all files that its parts name. The stages use the same functions for reading.
    pub fn read(path: &Path) -> Self {
        let ReadStudy { file, mistakes } = StudyFile::read_all(path, &[]);
        let mut all = Concerning::default();
        for StudyMistake { part, error } in without_repetitions(mistakes) {
            all.add(&part, error.to_string());
        }
        let Some(file) = file else {
            let unread = "correct these mistakes first; then the cases are read";
            return Self {
                understood: vec![("study", unread.to_owned())],
                mistakes: all.into_texts(usize::MAX),
                ..Self::default()
            };
        };
        let checks: Vec<(String, CaseCheck)> = file.settings.iter().flat_map(checks).collect();
        let [mut notes, mut warnings] = [Concerning::default(), Concerning::default()];
        for (folder, check) in &checks {
            check.notes.iter().for_each(|note| notes.add(folder, note.clone()));
            check.warnings.iter().for_each(|warning| warnings.add(folder, warning.clone()));
            check.mistakes.iter().for_each(|mistake| all.add(folder, mistake.clone()));
        }
        let mut understood = vec![("study", summary(&file))];
        let costs: Vec<&ExpectedCost> =
            checks.iter().filter_map(|(_, check)| check.cost.as_ref()).collect();
        let shared: Vec<_> = match &checks[..] {
            [(_, first), others @ ..] => {
                let is_shared =
                    |line: &&(_, _)| others.iter().all(|(_, c)| c.understood.contains(line));
                first.understood.iter().filter(is_shared).cloned().collect()
            }
            [] => Vec::new(),
        };
        understood.extend(shared.iter().cloned());
        if costs.len() > 1 {
            let total = ExpectedCost::sum(&costs).total();
            understood.push((
                "cost",
                format!("at most {total} (all parts; shared runs are counted for each part)"),
            ));
        }
        let count = checks.len();
        let checked_parts = checks.into_iter().map(|(folder, check)| {
            let only_here =
                check.understood.into_iter().filter(|line| !shared.contains(line)).collect();
            PartCheck { folder, understood: only_here }
        });
        Self {
            understood,
            parts: checked_parts.collect(),
            notes: notes.into_texts(count),
            warnings: warnings.into_texts(count),
            mistakes: all.into_texts(count),
        }
    }
}

impl Concerning {
    fn add(&mut self, part: &str, text: String) {
        match self.0.iter_mut().find(|(line, _)| *line == text) {
            Some((_, part_names)) => part_names.push(part.to_owned()),
            None => self.0.push((text, vec![part.to_owned()])),
        }
    }

    /// Returns the messages, each preceded by the names of its parts; `count` is the number of all parts.
    fn into_texts(self, count: usize) -> Vec<String> {
        let text = |(text, mut part_names): (String, Vec<String>)| {
            part_names.dedup();
            match &part_names[..] {
                [part_name] if part_name.is_empty() => text,
                all if all.len() == count && count > 1 => format!("all parts: {text}"),
                few if few.len() <= NAMED => format!("{}: {text}", few.join(", ")),
                [first, second, others @ ..] => {
                    format!("{first}, {second} and {} others: {text}", others.len())
                }
                [_] | [] => text,
            }
        };
        self.0.into_iter().map(text).collect()
    }
}

/// Removes mistakes of parts that repeat a mistake of the base case.
fn without_repetitions(mistakes: Vec<StudyMistake>) -> impl Iterator<Item = StudyMistake> {
    // the merged text may contain the same value with different spaces and quotes
    let bare = |value: &str| value.replace([' ', '"', '\''], "");
    let identity =
        move |error: &InputError| (error.place.clone(), bare(&error.value), error.problem.clone());
    let of_base: Vec<_> = mistakes
        .iter()
        .filter(|mistake| mistake.part.is_empty())
        .map(|mistake| identity(&mistake.error))
        .collect();
    mistakes.into_iter().filter(move |mistake| {
        mistake.part.is_empty() || !of_base.contains(&identity(&mistake.error))
    })
}

/// Checks all parts of a setting.
fn checks(setting: &StudySetting) -> Vec<(String, CaseCheck)> {
    let laboratories = setting.laboratories.iter().zip(setting.laboratory_folders());
    let laboratories = laboratories
        .map(|(laboratory, folder)| (folder, CaseCheck::of_laboratory(&laboratory.file)));
    let cases = setting.cases.iter().zip(setting.case_folders()).map(|(case, folder)| {
        let mut file = case.file.clone();
        if case.laboratory.is_some() {
            // the specimens are checked with the laboratory
            file.case.experiments = Some(experiments_in(None, &file));
        }
        let mut check = CaseCheck::of_calibration(&file);
        if let Some(laboratory) = &case.laboratory {
            let line = ("specimens", format!("those of the laboratory {laboratory}"));
            check.understood.insert(0, line);
        }
        (folder, check)
    });
    laboratories.chain(cases).collect()
}

/// Title of the study and numbers of its parts.
fn summary(file: &StudyFile) -> String {
    let count = |count: usize, one: &str, several: &str| match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        count => Some(format!("{count} {several}")),
    };
    let setting = &file.settings[0];
    let counts = [
        count(setting.cases.len(), "case", "cases"),
        count(setting.laboratories.len(), "laboratory", "laboratories"),
        count(file.settings.len() - 1, "variant of all of them", "variants of all of them"),
    ];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    format!("{}: {}", setting.title, counts.join(", "))
}
