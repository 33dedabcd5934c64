//! Progress of the stages in a results folder. The folder is not changed. Processes on this or another machine may be
//! writing to the folder at the same time.

use std::fmt;
use std::path::Path;

use super::copies::Copies;
use crate::case::CaseFile;
use crate::pipeline::freshness::{Freshness, Records, finished_in};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::stage::Stage;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::locks::{has_locks, holder};
use crate::runs::level_runs::FOLDER;
use crate::stages::ensemble::{Progress, progress};
use crate::stages::table::{STAGES, stages_of};

/// Progress of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageStatus {
    /// The stage.
    pub stage: &'static str,
    /// State of the stage.
    pub state: StageState,
    /// Progress of the runs; only for the stage `ensemble`, and only once the number of runs is known.
    pub runs: Option<RunCounts>,
}

/// State of a stage: finished, running or unfinished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StageState {
    /// The stage is finished, and nothing that it has read or written has changed.
    Done,
    /// A process is running the stage. Contains a description of the process if it is known.
    Running(Option<String>),
    /// The stage was finished, but has to be run again for this reason.
    Stale(String),
    /// The stage was started, but no process is running it.
    Stopped,
    /// The stage has not been started.
    ToDo,
}

/// Counts of the runs of an ensemble, on all meshes together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunCounts {
    /// Number of runs that are finished or have failed.
    pub ended: usize,
    /// Total number of runs, finished and planned.
    pub total: usize,
    /// Number of runs that processes are computing now.
    pub under_way: usize,
    /// Number of runs that ended without quantities of interest.
    pub failed: usize,
    /// Number of runs whose files cannot be read; such runs are computed again.
    pub damaged: usize,
    /// Number of runs whose checksum is missing or does not match their content; the stage stops at
    /// such a run.
    pub edited: usize,
    /// Runs per hour, computed from the number of runs under way and the mean time of ended runs; `None` if no run is
    /// under way.
    pub per_hour: Option<f64>,
    /// Remaining time at the rate `per_hour`, s.
    pub seconds_left: Option<f64>,
    /// Whether the remaining time excludes runs on a mesh on which no run has ended yet.
    pub is_at_least: bool,
}

/// Returns the progress of each stage of a results folder.
///
/// # Errors
/// Fails if the folder has no results, or if its case cannot be read.
pub fn status(dir: &Path) -> Result<Vec<StageStatus>, WorkflowError> {
    check_results(dir)?;
    let mut file = CaseFile::read(&dir.join("case.toml"))?;
    // an edited case.toml may name files that are copied only when a stage is run; use the original files
    if let Ok(copies) = Copies::of(&file, dir) {
        file.case = copies.case;
    }
    let records = finished_in(dir);
    let inputs = || Inputs::new(&file, dir, Stage::that_writes);
    let freshness = Freshness::default();
    let status_of = |stage: &'static Stage| {
        let runs = match stage.share {
            // the number of runs is unknown until the inputs of the runs exist
            Some(_) => {
                let levels = progress(&inputs(), dir).ok();
                // imported runs are not computed
                levels.filter(|levels| !levels.is_empty()).map(|levels| counts(&levels))
            }
            None => None,
        };
        let state = state(stage, &records, &inputs(), &freshness, dir, runs.as_ref());
        StageStatus { stage: stage.name, state, runs }
    };
    Ok(stages_of(&file.case).iter().map(status_of).collect())
}

/// Checks that the results folder of a stage that needs other stages exists. The stage `report` needs a folder in which a
/// stage has been run or started. A folder with a foreign file in the place of a product or a record is not refused here, so that
/// the message of the stage names the file.
///
/// # Errors
/// [`WorkflowError::NoResults`] with the reason.
pub(crate) fn check_begun(dir: &Path, stage: &Stage) -> Result<(), WorkflowError> {
    let refuse = |why| Err(WorkflowError::NoResults { path: dir.to_owned(), why });
    if !dir.exists() {
        return refuse("there is no such folder");
    }
    if !dir.is_dir() {
        return refuse("it is a file");
    }
    let records = ["case.toml", "origin.toml", "written.csv", "stages.toml", FOLDER, "tests"];
    let names = records.iter().chain(stage.products);
    let begun = has_locks(dir) || names.into_iter().any(|name| dir.join(name).exists());
    if begun || stage.name != "report" { Ok(()) } else { refuse("no stage has been run there") }
}

fn check_results(dir: &Path) -> Result<(), WorkflowError> {
    let refuse = |why| Err(WorkflowError::NoResults { path: dir.to_owned(), why });
    if !dir.exists() {
        return refuse("there is no such folder");
    }
    if !dir.is_dir() {
        return refuse("it is a file");
    }
    if !dir.join("case.toml").is_file() {
        return refuse("it has no case.toml");
    }
    let begun = has_locks(dir)
        || ["stages.toml", "origin.toml", FOLDER].iter().any(|n| dir.join(n).exists());
    if begun { Ok(()) } else { refuse("no stage has been run there") }
}

fn state(
    stage: &Stage,
    records: &Records,
    inputs: &Inputs<'_>,
    freshness: &Freshness,
    dir: &Path,
    runs: Option<&RunCounts>,
) -> StageState {
    let change = records.get(stage.name).map(|record| {
        record.change(inputs, dir).or_else(|| {
            // also check whether the stages that wrote the files which this stage read have to be run again
            let of_others =
                |name: &&str| inputs.writer_of(name) != Some(stage.name) && dir.join(name).exists();
            record.files_read().filter(of_others).find_map(|name| {
                match freshness.check(name, records, inputs, dir) {
                    Err(WorkflowError::Stale { stage, change, .. }) => {
                        Some(format!("{stage} before it is: {change}"))
                    }
                    _ => None,
                }
            })
        })
    });
    if let Some(None) = change {
        return StageState::Done;
    }
    let at_it = holder(dir, stage.name);
    if at_it.is_some() || runs.is_some_and(|runs| runs.under_way > 0) {
        return StageState::Running(at_it);
    }
    match change.flatten() {
        Some(change) => StageState::Stale(change),
        None if runs.is_some_and(|runs| runs.ended > 0) => StageState::Stopped,
        None => StageState::ToDo,
    }
}

/// Sums the counts of all levels. The remaining time is estimated from the mean time of ended runs and the number of
/// runs under way; clocks of other machines are not used.
fn counts(levels: &[Progress]) -> RunCounts {
    let sum = |count: fn(&Progress) -> usize| levels.iter().map(count).sum::<usize>();
    let under_way = sum(|level| level.under_way);
    let mean = |level: &Progress| (level.ended > 0).then(|| level.seconds / level.ended as f64);
    let left = |level: &&Progress| level.ended < level.total;
    let at = levels.iter().find(|level| level.under_way > 0 && level.ended > 0);
    let pace = |seconds: f64| under_way as f64 / seconds.max(1e-9);
    let rest: Vec<Option<f64>> = levels
        .iter()
        .filter(left)
        .map(|level| mean(level).map(|seconds| (level.total - level.ended) as f64 / pace(seconds)))
        .collect();
    let remaining: f64 = rest.iter().flatten().sum();
    RunCounts {
        ended: sum(|level| level.ended),
        total: sum(|level| level.total),
        under_way,
        failed: sum(|level| level.failed),
        damaged: sum(|level| level.damaged),
        edited: sum(|level| level.edited),
        per_hour: at.and_then(mean).map(|seconds| 3600.0 * pace(seconds)),
        seconds_left: at.map(|_| remaining),
        is_at_least: rest.contains(&None),
    }
}

impl StageStatus {
    /// Returns the status of a folder in which no stage has been started.
    pub fn none() -> Vec<StageStatus> {
        let no_status =
            |stage: &Stage| StageStatus { stage: stage.name, state: StageState::ToDo, runs: None };
        STAGES.iter().map(no_status).collect()
    }

    /// Whether the stage is running, stopped or not started.
    pub(super) fn is_unfinished(&self) -> bool {
        !matches!(self.state, StageState::Done | StageState::Stale(_))
    }

    /// Whether the stage is finished and up to date.
    pub fn is_done(&self) -> bool {
        self.state == StageState::Done
    }
}

impl StageStatus {
    /// The state as one word, and details.
    pub(super) fn words(&self) -> (&'static str, String) {
        let (word, mut notes) = match &self.state {
            StageState::Done => ("done", vec![]),
            StageState::Running(at_it) => ("running", at_it.iter().cloned().collect()),
            StageState::Stale(change) => ("stale", vec![change.clone()]),
            StageState::Stopped => ("stopped", vec!["no process computes them".to_owned()]),
            StageState::ToDo => ("to do", vec![]),
        };
        if let Some(runs) = self.runs.filter(|_| self.state != StageState::ToDo) {
            notes.insert(0, runs.to_string());
        }
        (word, notes.join("; "))
    }
}

impl fmt::Display for StageStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (word, notes) = self.words();
        write!(f, "{:<12} {word:<8} {notes}", self.stage)
    }
}

impl fmt::Display for RunCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} runs", self.ended, self.total)?;
        if self.under_way > 0 {
            write!(f, ", {} under way", self.under_way)?;
        }
        if let Some(rate) = self.per_hour {
            write!(
                f,
                ", {} per hour",
                if rate < 10.0 { format!("{rate:.1}") } else { format!("{rate:.0}") }
            )?;
        }
        if let Some(seconds) = self.seconds_left {
            let more = if self.is_at_least { "more than " } else { "" };
            write!(f, ", {more}{} left", duration(seconds))?;
        }
        if self.failed > 0 {
            write!(f, ", {} failed (failed_runs.csv at the end)", self.failed)?;
        }
        if self.damaged > 0 {
            write!(f, ", {} damaged and made again", self.damaged)?;
        }
        if self.edited > 0 {
            write!(f, ", {} changed after they were recorded, which stops the stage", self.edited)?;
        }
        Ok(())
    }
}

/// Formats a time, given in seconds, in a convenient unit.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(ended: usize, total: usize, under_way: usize, seconds: f64) -> Progress {
        Progress { ended, total, under_way, seconds, ..Progress::default() }
    }

    /// Four runs at a time with one minute each are 240 runs per hour, so that the remaining 60 runs take a quarter of
    /// an hour.
    #[test]
    fn pace_and_time_left_come_from_what_ended_and_what_is_under_way() {
        let runs = counts(&[level(40, 100, 4, 2400.0)]);
        assert_eq!((runs.per_hour, runs.seconds_left), (Some(240.0), Some(900.0)));
        assert_eq!(runs.to_string(), "40 of 100 runs, 4 under way, 240 per hour, 15 min left");
        // ten runs on a finer mesh, all unfinished
        let runs = counts(&[level(40, 100, 4, 2400.0), level(0, 10, 0, 0.0)]);
        assert!(runs.is_at_least && runs.seconds_left == Some(900.0));
        assert!(runs.to_string().contains("more than 15 min left"));
        // one run on the finer mesh took ten minutes; nine runs remain, four at a time
        let runs = counts(&[level(100, 100, 0, 6000.0), level(1, 10, 4, 600.0)]);
        assert_eq!((runs.per_hour, runs.seconds_left), (Some(24.0), Some(1350.0)));
        // no run under way: no rate
        let runs = counts(&[level(40, 100, 0, 2400.0)]);
        assert_eq!((runs.per_hour, runs.seconds_left), (None, None));
    }
}
