//! Stage `ensemble`: the simulations to which the surrogate is fitted.

use std::collections::BTreeMap;
use std::path::Path;

use fem::{EnsembleState, RunInput, RunRecord, write_curve};
use surrogate::{Dataset, Input};

use super::sequential::{Batches, Look};
use crate::forward::fitted::BATCH;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::neighbours::Neighbours;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::runs::ensemble_runs::folder_of_runs;
use crate::runs::fidelity::{Correction, spread, write_corrections};
use crate::runs::first_runs::{SpecimenSize, check_first_runs, first_of};
use crate::runs::level_runs::{FOLDER, LevelRuns, Runner, curve_of_level};
use crate::runs::made_on::{IMAGE, MadeOn, SEED};
use crate::runs::microstructures::Microstructures;
use crate::runs::quadrature::compare_quadratures;
use crate::runs::run_source::{RunSource, key_of_runs};
use crate::runs::run_sources::source_of;
use crate::runs::unusable_runs::{RunOrigin, UnusableRuns};
use crate::simulation::setup::{height_mm, radius_mm};
use crate::simulation::stiffness::STIFFNESS_RATIO;
use crate::specimen::levels::Level;

/// Columns of notes in `runs.csv`, for every ensemble: number of the run, computing time (s), seed of the packing, and
/// stiffness ratio of the packing.
const NOTES: [&str; 4] = ["run", "seconds", SEED, STIFFNESS_RATIO];

/// Smallest number of runs from which a surrogate can be fitted.
const LEAST_ROWS: usize = 2;

/// The runs of a case, their specimens and their mesh levels.
pub(crate) struct Plan<'a> {
    source: Box<dyn RunSource>,
    prior: Vec<Input>,
    names: Vec<String>,
    runs: Vec<RunInput>,
    /// Specimens of the runs; `None` if all runs use the specimen of the case.
    specimens: Option<Microstructures>,
    levels: Vec<Level<'a>>,
    /// Batches of runs that are added in the region of the posterior.
    batches: Option<Batches<'a>>,
}

impl<'a> Plan<'a> {
    /// Creates the plan of a case, without batches. At most `filled` packings are generated.
    pub(crate) fn of(inputs: &'a Inputs<'_>, filled: usize) -> Result<Self, WorkflowError> {
        inputs.check_steps()?;
        let first = inputs.first_prior()?;
        let design = inputs.design();
        let source = source_of(inputs)?;
        let mut parameter_points = match source.parameter_points() {
            Some(parameter_points) => parameter_points,
            None => design.parameter_points(first, design.runs, design.seed)?,
        };
        let mut specimens = source.specimens(inputs, filled.min(parameter_points.len()))?;
        let levels = Level::all(inputs, &key_of_runs(inputs, &*source, specimens.as_ref())?);
        source.read_rest(inputs);
        let prior = inputs.prior()?;
        for (extension, k) in inputs.extend().iter().zip(1..) {
            let within = first.within(&extension.prior);
            parameter_points.extend(design.parameter_points(
                &within,
                extension.runs,
                design.seed.wrapping_add(k),
            )?);
        }
        if !inputs.extend().is_empty() {
            specimens = source.specimens(inputs, filled.min(parameter_points.len()))?;
        }
        let run = |(i, inputs)| RunInput { id: i + 1, inputs };
        let runs: Vec<RunInput> = parameter_points.into_iter().enumerate().map(run).collect();
        let names = prior.iter().map(|input| input.name.clone()).collect();
        Ok(Self { source, prior, names, runs, specimens, levels, batches: None })
    }

    /// Creates the plan of a case, with the batches of `[sequential]`; `dir` is the results folder.
    fn with_batches(
        inputs: &'a Inputs<'_>,
        dir: &Path,
        filled: usize,
    ) -> Result<Self, WorkflowError> {
        let mut plan = Self::of(inputs, filled)?;
        let runs = plan.runs.len();
        plan.batches = Batches::of(inputs, &plan.levels[0], dir, runs)?;
        if let Some(batches) = &plan.batches {
            plan.specimens = plan.source.specimens(inputs, filled.min(runs + batches.most()))?;
        }
        Ok(plan)
    }

    /// Computes the runs of the design on all levels. Returns the runs with their quantities.
    pub(crate) fn make(&self, task: &Task<'_>) -> Result<Vec<LevelRuns>, WorkflowError> {
        all_levels(&self.runner(task), self)
    }

    /// Computes the runs of the design on the first level only, for a case without a mesh from the stage `mesh`.
    pub(crate) fn make_cheap(&mut self, task: &Task<'_>) -> Result<LevelRuns, WorkflowError> {
        let level = &mut self.levels[0];
        level.is_made_anew = true;
        level.key = level.key.and_specimen(&task.inputs)?;
        let level = &self.levels[0];
        let records = self.runner(task).run(level, &self.runs, true)?;
        Ok(LevelRuns::new(records, task.inputs.qoi(), level.setup.derivatives))
    }

    /// Returns the dataset to which a surrogate is fitted, and the corrections. The dataset contains the runs of the
    /// first level with the given quantities, corrected by means of the runs that were repeated on more accurate
    /// levels.
    pub(crate) fn learnt(
        &self,
        inputs: &Inputs<'_>,
        quantities: &[Quantity],
        done: &[LevelRuns],
    ) -> Result<(Dataset, Vec<Correction>), WorkflowError> {
        let mut corrected = Corrected::by(self, quantities, done)?;
        let data = corrected.data(self, inputs, &done[0])?;
        Ok((data, corrected.corrections))
    }

    /// Compares the first runs with the specimens before the other runs are made. A process that does not wait for the
    /// runs of other processes (`leave_to_others`) skips the comparison.
    fn check_first(&self, runner: &Runner<'_>) -> Result<(), WorkflowError> {
        let task = runner.task;
        let [level, ..] = &self.levels[..] else { return Ok(()) };
        // without a mesh, the size to which specimens are scaled is unknown
        if !task.inputs.is_built_in()
            || task.leave_to_others
            || !task.path("experiments.csv").is_file()
        {
            return Ok(());
        }
        let records = runner.run(level, first_of(task, &self.runs), true)?;
        let Some(run) = records.first() else { return Ok(()) };
        let mesh = runner.mesh(level, run.id)?;
        let size = SpecimenSize { height_mm: height_mm(&mesh), radius_mm: radius_mm(&mesh) };
        check_first_runs(task, &level.setup, size, &records)
    }

    fn runner<'r>(&'r self, task: &'r Task<'r>) -> Runner<'r> {
        let (source, specimens) = (&*self.source, self.specimens.as_ref());
        Runner { task, source, names: &self.names, specimens }
    }
}

/// Computes the runs; any number of processes may share them. Levels and batches are computed sequentially, because the
/// choice of runs for the next level, and of points for the next batch, depends on earlier results.
pub(crate) fn share(task: &Task<'_>) -> Result<(), WorkflowError> {
    let plan = Plan::with_batches(&task.inputs, &task.path(""), usize::MAX)?;
    if let Some(specimens) = &plan.specimens {
        let first = &plan.runs[0].inputs;
        plan.levels.iter().try_for_each(|level| specimens.check(&task.inputs, level, first))?;
    }
    let runner = plan.runner(task);
    plan.check_first(&runner)?;
    with_batches(&runner, &plan, all_levels(&runner, &plan)?).map(drop)
}

/// Writes the results of the runs.
pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let plan = Plan::with_batches(&task.inputs, &task.path(""), usize::MAX)?;
    let runner = plan.runner(task);
    plan.source.notes().iter().for_each(|note| say("note", note));
    let design = all_levels(&runner, &plan)?;
    compare_quadratures(&runner, &plan.levels[0], &plan.prior, &design[0])?;
    let Made { done, looks, mut corrected } = with_batches(&runner, &plan, design)?;
    let data = corrected.data(&plan, &task.inputs, &done[0])?;
    let (first, corrections) = (&done[0], &corrected.corrections);
    let is_built_in = task.inputs.is_built_in();
    for record in first.records.iter().filter(|run| is_built_in || !run.curve.is_empty()) {
        let name = format!("curves/run-{:03}.csv", record.id);
        task.product(&name, |path| write_curve(path, &record.curve))?;
    }
    for (level, better) in (2..).zip(&done[1..]) {
        for record in &better.records {
            let name = curve_of_level(level, &record.id.to_string());
            task.product(&name, |path| write_curve(path, &record.curve))?;
        }
    }
    let table = data.to_csv().map_err(|e| WorkflowError::io(&task.path("runs.csv"), e))?;
    task.write("runs.csv", table)?;
    write_failures(task, &plan.names, &done)?;
    warn_of_failures(task, first);
    if !corrections.is_empty() {
        write_corrections(task, &data, &done, corrections, &MadeOn::of(&data))?;
    }
    if let Some(batches) = &plan.batches {
        batches.write(task, &looks)?;
    }
    let seconds: f64 = done.iter().flat_map(|level| &level.records).map(|r| r.seconds).sum();
    let all = first.records.len();
    let words = match all - plan.runs.len() {
        0 => format!("{} of {all} runs usable, ", data.len()),
        placed => {
            format!("{} of {all} runs usable, {placed} in the posterior, ", data.len())
        }
    };
    Ok(words
        + &match &done[1..] {
            [] => format!("processor time {:.1} s per run", seconds / all as f64),
            better => {
                let counts: Vec<_> = better.iter().map(|l| l.records.len().to_string()).collect();
                format!(
                    "{} repeated on a more accurate mesh, processor time {seconds:.0} s",
                    counts.join(" and ")
                )
            }
        })
}

/// Finished runs, intermediate calibrations (called *looks*, see the module `sequential`), and corrections
/// between meshes.
struct Made {
    /// The runs of each level; runs of batches belong to the first level.
    done: Vec<LevelRuns>,
    looks: Vec<Look>,
    corrected: Corrected,
}

/// Computes the batches after the runs of the design. Only runs of the design are repeated on more accurate meshes,
/// because the corrections must be valid over the whole prior box.
fn with_batches(
    runner: &Runner<'_>,
    plan: &Plan<'_>,
    mut done: Vec<LevelRuns>,
) -> Result<Made, WorkflowError> {
    let quantities = &runner.task.inputs.qoi().quantities;
    // a process that does not wait for other processes may lack the repeated runs from which corrections are fitted
    if runner.task.leave_to_others && plan.batches.is_none() {
        let corrected = Corrected::by(plan, quantities, &done[..1])?;
        return Ok(Made { done, looks: Vec::new(), corrected });
    }
    let mut corrected = Corrected::by(plan, quantities, &done)?;
    let looks = match &plan.batches {
        Some(batches) => batches.make(runner, &mut done[0], &mut |first| {
            let data = corrected.data(plan, &runner.task.inputs, first)?;
            Ok((data, corrected.corrections.iter().map(|c| c.report().clone()).collect()))
        })?,
        None => Vec::new(),
    };
    Ok(Made { done, looks, corrected })
}

/// Builds the dataset of the surrogate from runs, with corrections between mesh levels.
struct Corrected {
    /// Names of the quantities' columns.
    outputs: Vec<String>,
    corrections: Vec<Correction>,
    /// Stiffness ratio of each specimen (by index) for which it has been computed.
    stiffness: BTreeMap<usize, f64>,
}

impl Corrected {
    /// Fits a correction for each level from the runs that were repeated on the next level.
    fn by(
        plan: &Plan<'_>,
        quantities: &[Quantity],
        done: &[LevelRuns],
    ) -> Result<Self, WorkflowError> {
        let outputs: Vec<String> = quantities.iter().map(|q| q.column().into_owned()).collect();
        let corrections = done
            .windows(2)
            .map(|pair| Correction::between(&plan.prior, &outputs, &pair[0], &pair[1]))
            .collect::<Result<_, _>>()?;
        Ok(Self { outputs, corrections, stiffness: BTreeMap::new() })
    }

    /// Builds the dataset of the surrogate from the runs `first` of the first fidelity level. Each run with quantities
    /// of interest gives one row: inputs, corrected quantities, their derivatives and notes.
    fn data(
        &mut self,
        plan: &Plan<'_>,
        inputs: &Inputs<'_>,
        first: &LevelRuns,
    ) -> Result<Dataset, WorkflowError> {
        let Plan { prior, specimens, levels, batches, .. } = plan;
        if let Some(specimens) = specimens {
            let all = first.records.iter().map(|record| specimens.of_run(record.id));
            let more = all.filter(|specimen| !self.stiffness.contains_key(specimen)).collect();
            self.stiffness.extend(specimens.stiffness_ratios(inputs, &levels[0], &more)?);
        }
        let differentiated = if inputs.design().derivatives { prior.len() } else { 0 };
        let mut names = NOTES.to_vec();
        let of_images = specimens.as_ref().is_some_and(|all| all.column() == IMAGE);
        names.extend(of_images.then_some(IMAGE));
        names.extend(batches.as_ref().map(|_| BATCH));
        let mut data = Dataset::new(prior.clone(), self.outputs.clone(), "breccia ensemble")?
            .with_derivatives_in(differentiated)?
            .with_notes(&names)?;
        for (record, quantities, jacobian) in first.differentiated() {
            let (mut quantities, mut jacobian) = (quantities.to_vec(), jacobian.to_vec());
            for correction in &self.corrections {
                correction.apply(&record.inputs, &mut quantities, &mut jacobian)?;
            }
            let run_specimens = specimens.as_ref();
            let ratio = run_specimens.and_then(|all| self.stiffness.get(&all.of_run(record.id)));
            let batch = batches.as_ref().and_then(|b| b.batch_of(record.id));
            let note = |name: &&str| match *name {
                "run" => record.id.to_string(),
                "seconds" => format!("{:.3}", record.seconds),
                STIFFNESS_RATIO => ratio.map(f64::to_string).unwrap_or_default(),
                BATCH => batch.map(|batch| batch.to_string()).unwrap_or_default(),
                column => {
                    let named = run_specimens.filter(|all| all.column() == column);
                    named.map(|all| all.name(record.id)).unwrap_or_default()
                }
            };
            let notes: Vec<String> = names.iter().map(note).collect();
            let notes: Vec<&str> = notes.iter().map(String::as_str).collect();
            match differentiated {
                0 => data.push_noted(&record.inputs, &quantities, &notes)?,
                _ => data.push_differentiated(&record.inputs, &quantities, &jacobian, &notes)?,
            }
        }
        Ok(data)
    }
}

/// Computes all runs on the first level, and repeats some of them on the next level, and so on. `repeats` of a level is
/// the number of its runs that are repeated; these runs are spread over the prior box.
fn all_levels(runner: &Runner<'_>, plan: &Plan<'_>) -> Result<Vec<LevelRuns>, WorkflowError> {
    let mut runs = plan.runs.clone();
    let mut done: Vec<LevelRuns> = Vec::new();
    for (k, level) in plan.levels.iter().enumerate() {
        // the runs to repeat and the points of a batch are chosen when all runs of this level have ended; nothing is
        // chosen after the last level, so that a process need not wait for others
        let is_last = k + 1 == plan.levels.len() && plan.batches.is_none();
        let records = runner.run(level, &runs, !(is_last && runner.task.leave_to_others))?;
        let qoi = runner.task.inputs.qoi();
        let level_runs = LevelRuns::new(records, qoi, level.setup.derivatives);
        // a process that does not wait for other processes may lack runs
        if k == 0 && !runner.task.leave_to_others {
            check_usable(&runner.task.inputs, &level_runs, plan.prior.len())?;
        }
        let usable: Vec<&RunRecord> = level_runs.usable().map(|(record, _)| record).collect();
        let parameter_points: Vec<&[f64]> =
            usable.iter().map(|record| &record.inputs[..]).collect();
        let specimen = |run: &&RunRecord| match &plan.specimens {
            Some(specimens) => specimens.of_run(run.id),
            None => 0,
        };
        let specimens: Vec<usize> = usable.iter().map(specimen).collect();
        let repeated = spread(&plan.prior, &parameter_points, &specimens, level.repeats);
        let input = |i: usize| RunInput { id: usable[i].id, inputs: usable[i].inputs.clone() };
        runs = repeated.into_iter().map(input).collect();
        done.push(level_runs);
    }
    Ok(done)
}

/// Progress of the runs of one level or of the batches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Progress {
    pub(crate) ended: usize,
    pub(crate) total: usize,
    pub(crate) under_way: usize,
    /// Number of ended runs without quantities.
    pub(crate) failed: usize,
    pub(crate) damaged: usize,
    pub(crate) edited: usize,
    /// Total computing time of the ended runs, s.
    pub(crate) seconds: f64,
}

/// Returns the progress of each level, and of the batches if there are any. Starts no run and writes nothing.
///
/// # Errors
/// Fails if the case has no prior or no specimens, if the mesh that all runs share is missing, or if files cannot be
/// read.
pub(crate) fn progress(inputs: &Inputs<'_>, dir: &Path) -> Result<Vec<Progress>, WorkflowError> {
    // one packing is sufficient, because the identity of the runs does not depend on the number of generated packings
    let plan = Plan::with_batches(inputs, dir, 1)?;
    if plan.source.parameter_points().is_some() {
        // there is nothing to compute
        return Ok(Vec::new());
    }
    let neighbours = Neighbours::of(dir);
    let look = |folder: &Path, derivatives: bool, total: usize| {
        let state = EnsembleState::of(folder)?;
        let runs = LevelRuns::new(state.records, inputs.qoi(), derivatives);
        let (ended, failed) = (runs.records.len().min(total), runs.failed().count());
        let seconds = runs.records.iter().map(|record| record.seconds).sum();
        let (under_way, damaged) = (state.under_way.len(), state.damaged.len());
        let edited = state.edited.len();
        Ok::<_, WorkflowError>(Progress {
            ended,
            total,
            under_way,
            failed,
            damaged,
            edited,
            seconds,
        })
    };
    let mut total = plan.runs.len();
    let mut all = Vec::new();
    for level in &plan.levels {
        let folder = folder_of_runs(dir, neighbours.as_ref(), FOLDER, &level.key);
        let progress = look(&folder, level.setup.derivatives, total)?;
        total = level.repeats.min(total - progress.failed.min(total));
        all.push(progress);
    }
    // add the runs of batches whose points have been chosen
    if let Some((expected, folder)) = plan.batches.as_ref().map(Batches::chosen_runs) {
        all.push(look(folder, plan.levels[0].setup.derivatives, expected)?);
    }
    Ok(all)
}

/// Returns the ended runs on the first level, including the runs of batches, and the number of levels.
///
/// # Errors
/// The errors of [`progress`].
pub(crate) fn so_far(inputs: &Inputs<'_>) -> Result<(LevelRuns, usize), WorkflowError> {
    let dir = inputs.folder();
    let plan = Plan::with_batches(inputs, dir, 1)?;
    let level = &plan.levels[0];
    if plan.source.parameter_points().is_some() {
        let none = LevelRuns::new(Vec::new(), inputs.qoi(), false);
        return Ok((none, plan.levels.len()));
    }
    let ended = |folder: &Path| {
        let records = EnsembleState::of(folder)?.records;
        Ok::<_, WorkflowError>(LevelRuns::new(records, inputs.qoi(), level.setup.derivatives))
    };
    let mut runs = ended(&folder_of_runs(dir, Neighbours::of(dir).as_ref(), FOLDER, &level.key))?;
    if let Some(batches) = &plan.batches {
        runs.extend(ended(batches.chosen_runs().1)?);
    }
    Ok((runs, plan.levels.len()))
}

/// Prints a warning about runs without quantities. The stage `verdict` repeats the warning beside the results (see the rule
/// `unusable_runs`).
fn warn_of_failures(task: &Task<'_>, runs: &LevelRuns) {
    let failed = runs.failed().map(|(record, reason)| (record.id, reason));
    let origin = RunOrigin::of(&task.inputs);
    if let Some(unusable) = UnusableRuns::of(runs.records.len(), failed, origin) {
        say("warning", &unusable.warning());
    }
}

/// Checks that enough runs have quantities for a fit. If runs failed, a surrogate of first order must be possible: at least
/// one run more than there are parameters, unless the runs have derivatives.
fn check_usable(
    inputs: &Inputs<'_>,
    runs: &LevelRuns,
    parameters: usize,
) -> Result<(), WorkflowError> {
    let least =
        if inputs.design().derivatives { LEAST_ROWS } else { LEAST_ROWS.max(parameters + 1) };
    if runs.usable().count() >= least {
        return Ok(());
    }
    let failed = runs.failed().map(|(record, reason)| (record.id, reason));
    match UnusableRuns::of(runs.records.len(), failed, RunOrigin::of(inputs)) {
        Some(unusable) => Err(WorkflowError::Unusable(unusable.too_few(least))),
        None => Ok(()),
    }
}

/// Writes `failed_runs.csv`: the runs without quantities, each with the reason.
fn write_failures(
    task: &Task<'_>,
    names: &[String],
    done: &[LevelRuns],
) -> Result<(), WorkflowError> {
    let row = |level: usize, record: &RunRecord, reason: &str| {
        let location = if level == 0 { String::new() } else { format!("on level {}: ", level + 1) };
        let values = record.inputs.iter().map(f64::to_string);
        let rest = [format!("{:.3}", record.seconds), format!("{location}{reason}")];
        [record.id.to_string()].into_iter().chain(values).chain(rest).collect::<Vec<_>>()
    };
    let rows = done.iter().enumerate().flat_map(|(level, runs)| {
        runs.failed().map(move |(record, reason)| row(level, record, reason))
    });
    let header =
        ["run"].into_iter().chain(names.iter().map(String::as_str)).chain(["seconds", "reason"]);
    task.write_csv("failed_runs.csv", header, rows)
}
