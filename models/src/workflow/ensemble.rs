//! Stage `ensemble`: the simulations that the surrogate learns from.

use std::path::Path;

use fem::{EnsembleState, RunInput, RunRecord, write_curve};
use surrogate::{Dataset, Input};

use super::WorkflowError;
use super::fidelity::{Correction, spread, write_corrections};
use super::files::write;
use super::inputs::Inputs;
use super::level_runs::{FOLDER, LevelRuns, Runner};
use super::levels::Level;
use super::neighbours::Neighbours;
use super::packings::{Packings, SEED};
use super::quadrature::compare_quadratures;
use super::runs::place;
use super::stiffness::STIFFNESS_RATIO;
use super::task::Task;
use crate::qoi::Quantity;

/// What is known of a run beside its numbers; seed and stiffness are those of a packing of its own.
const NOTES: [&str; 4] = ["run", "seconds", SEED, STIFFNESS_RATIO];

/// The runs of a case and the meshes that they are made on.
pub(super) struct Plan<'a> {
    prior: Vec<Input>,
    names: Vec<String>,
    runs: Vec<RunInput>,
    packings: Option<Packings>,
    levels: Vec<Level<'a>>,
}

impl<'a> Plan<'a> {
    /// What the case asks for; so many of the packings are filled.
    pub(super) fn of(inputs: &'a Inputs<'_>, filled: usize) -> Result<Self, WorkflowError> {
        inputs.check_steps()?;
        let first = inputs.first_prior()?;
        let design = inputs.design();
        let mut points = design.method.sample(&first, design.runs, design.seed)?;
        let mut packings = Packings::of(inputs, filled.min(points.len()))?;
        let levels = Level::all(inputs, packings.is_some())?;
        // what is read from here on leaves the runs before as they are
        let prior = inputs.prior()?;
        for (extension, k) in inputs.extend().iter().zip(1..) {
            let mut within = first.clone();
            for input in extension.prior.inputs()? {
                within
                    .iter_mut()
                    .filter(|own| own.name == input.name)
                    .for_each(|own| *own = input.clone());
            }
            let seed = design.seed.wrapping_add(k);
            points.extend(design.method.sample(&within, extension.runs, seed)?);
        }
        if !inputs.extend().is_empty() {
            packings = Packings::of(inputs, filled.min(points.len()))?;
        }
        let run = |(i, inputs)| RunInput { id: i + 1, inputs };
        let runs: Vec<RunInput> = points.into_iter().enumerate().map(run).collect();
        let names = prior.iter().map(|input| input.name.clone()).collect();
        Ok(Self { prior, names, runs, packings, levels })
    }

    fn runner<'r>(&'r self, task: &'r Task<'r>) -> Runner<'r> {
        Runner { task, names: &self.names, packings: self.packings.as_ref() }
    }

    /// The runs with their quantities, on all levels.
    pub(super) fn make(&self, task: &Task<'_>) -> Result<Vec<LevelRuns>, WorkflowError> {
        all_levels(&self.runner(task), self)
    }

    /// The same on the first level alone, of a case whose mesh no stage has made.
    pub(super) fn make_cheap(&mut self, task: &Task<'_>) -> Result<LevelRuns, WorkflowError> {
        self.levels[0].is_made_anew = true;
        let level = &self.levels[0];
        let records = self.runner(task).run(level, &self.runs, true)?;
        Ok(LevelRuns::new(records, task.inputs.qoi(), level.setup.derivatives))
    }

    /// What a surrogate learns from: the runs of the first level with these quantities, which those on
    /// better levels correct, and the corrections.
    pub(super) fn learnt(
        &self,
        inputs: &Inputs<'_>,
        quantities: &[Quantity],
        done: &[LevelRuns],
    ) -> Result<(Dataset, Vec<Correction>), WorkflowError> {
        let Self { prior, packings, levels, .. } = self;
        let outputs: Vec<String> = quantities.iter().map(|q| q.column().into_owned()).collect();
        let corrections = done
            .windows(2)
            .map(|pair| Correction::between(prior, &outputs, &pair[0], &pair[1]))
            .collect::<Result<Vec<_>, _>>()?;
        let stiffness = packings.as_ref().map(|p| p.stiffness_ratios(&levels[0])).transpose()?;
        let differentiated = if inputs.design().derivatives { prior.len() } else { 0 };
        let mut data = Dataset::new(prior.clone(), outputs, "breccia ensemble")?
            .with_derivatives_in(differentiated)?
            .with_notes(&NOTES)?;
        for (record, quantities, jacobian) in done[0].differentiated() {
            let (mut quantities, mut jacobian) = (quantities.to_vec(), jacobian.to_vec());
            for correction in &corrections {
                correction.apply(&record.inputs, &mut quantities, &mut jacobian)?;
            }
            let (id, seconds) = (record.id.to_string(), format!("{:.3}", record.seconds));
            let seed = packings.as_ref().map(|p| p.seeds[record.id - 1].to_string());
            let ratio = stiffness.as_ref().map(|ratios| ratios[record.id - 1].to_string());
            let [seed, ratio] = [seed, ratio].map(Option::unwrap_or_default);
            let notes: [&str; 4] = [&id, &seconds, &seed, &ratio];
            match differentiated {
                0 => data.push_noted(&record.inputs, &quantities, &notes)?,
                _ => data.push_differentiated(&record.inputs, &quantities, &jacobian, &notes)?,
            }
        }
        Ok((data, corrections))
    }
}

/// Makes the runs, which any number of processes share: on one mesh after the other, since which are
/// repeated is known from those before.
pub(super) fn share(task: &Task<'_>) -> Result<(), WorkflowError> {
    let plan = Plan::of(&task.inputs, usize::MAX)?;
    if let Some(packings) = &plan.packings {
        plan.levels.iter().try_for_each(|level| packings.check(level, &plan.runs[0].inputs))?;
    }
    plan.make(task).map(drop)
}

/// Writes what the runs have given.
pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let plan = Plan::of(&task.inputs, usize::MAX)?;
    let done = plan.make(task)?;
    compare_quadratures(&plan.runner(task), &plan.levels[0], &plan.prior, &done[0])?;
    let quantities = &task.inputs.qoi().quantities;
    let (data, corrections) = plan.learnt(&task.inputs, quantities, &done)?;
    let Plan { names, runs, packings, .. } = plan;
    let first = &done[0];
    for record in &first.records {
        write_curve(task.product(&format!("curves/run-{:03}.csv", record.id))?, &record.curve)?;
    }
    let path = task.product("runs.csv")?;
    write(&path, &data.to_csv().map_err(|e| WorkflowError::io(&path, e))?)?;
    write_failures(task, &names, &done)?;
    if !corrections.is_empty() {
        write_corrections(task, &data, &done, &corrections, packings.is_some())?;
    }
    let seconds: f64 = done.iter().flat_map(|level| &level.records).map(|r| r.seconds).sum();
    let told = format!("{} of {} runs usable, ", data.len(), runs.len());
    Ok(told
        + &match &done[1..] {
            [] => format!("{:.1} s a run", seconds / runs.len() as f64),
            better => {
                let counts: Vec<_> = better.iter().map(|l| l.records.len().to_string()).collect();
                format!("{} repeated on a better mesh, {seconds:.0} s in all", counts.join(" and "))
            }
        })
}

/// All runs on the first level, and from each to the next as many as it says, spread over the box.
fn all_levels(runner: &Runner<'_>, plan: &Plan<'_>) -> Result<Vec<LevelRuns>, WorkflowError> {
    let mut runs = plan.runs.clone();
    let mut done: Vec<LevelRuns> = Vec::new();
    for (k, level) in plan.levels.iter().enumerate() {
        // which runs are repeated is known once all have ended; nothing comes after the last mesh
        let is_last = k + 1 == plan.levels.len();
        let records = runner.run(level, &runs, !(is_last && runner.task.leave_to_others))?;
        let qoi = runner.task.inputs.qoi();
        let level_runs = LevelRuns::new(records, qoi, level.setup.derivatives);
        let usable: Vec<&RunRecord> = level_runs.usable().map(|(record, _)| record).collect();
        let points: Vec<&[f64]> = usable.iter().map(|record| &record.inputs[..]).collect();
        let repeated = spread(&plan.prior, &points, level.repeats);
        let input = |i: usize| RunInput { id: usable[i].id, inputs: usable[i].inputs.clone() };
        runs = repeated.into_iter().map(input).collect();
        done.push(level_runs);
    }
    Ok(done)
}

/// How far the runs on a mesh have come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Progress {
    pub(super) ended: usize,
    pub(super) total: usize,
    pub(super) under_way: usize,
    /// Of those that ended, without quantities.
    pub(super) failed: usize,
    pub(super) damaged: usize,
    /// Those that ended took this long together.
    pub(super) seconds: f64,
}

/// How far the runs of each level have come; nothing is run or written.
///
/// # Errors
/// A case without prior or specimens, or without the mesh that all runs share; files that cannot be read.
pub(super) fn progress(inputs: &Inputs<'_>, dir: &Path) -> Result<Vec<Progress>, WorkflowError> {
    // one packing is as many as it takes to know that there are any
    let plan = Plan::of(inputs, 1)?;
    let neighbours = Neighbours::of(dir);
    let mut total = plan.runs.len();
    let mut found = Vec::new();
    for level in &plan.levels {
        let state = EnsembleState::of(&place(dir, neighbours.as_ref(), FOLDER, &level.manifest))?;
        let runs = LevelRuns::new(state.records, inputs.qoi(), level.setup.derivatives);
        let (ended, failed) = (runs.records.len().min(total), runs.failed().count());
        let seconds = runs.records.iter().map(|record| record.seconds).sum();
        let (under_way, damaged) = (state.under_way.len(), state.damaged.len());
        found.push(Progress { ended, total, under_way, failed, damaged, seconds });
        total = level.repeats.min(total - failed.min(total));
    }
    Ok(found)
}

/// The runs on the first mesh that have ended until now, and on how many meshes there are some.
///
/// # Errors
/// As [`progress`].
pub(super) fn so_far(inputs: &Inputs<'_>) -> Result<(LevelRuns, usize), WorkflowError> {
    let plan = Plan::of(inputs, 1)?;
    let (level, dir) = (&plan.levels[0], inputs.folder());
    let runs = place(dir, Neighbours::of(dir).as_ref(), FOLDER, &level.manifest);
    let records = EnsembleState::of(&runs)?.records;
    Ok((LevelRuns::new(records, inputs.qoi(), level.setup.derivatives), plan.levels.len()))
}

/// `failed_runs.csv`: runs without quantities, with the reason.
fn write_failures(
    task: &Task<'_>,
    names: &[String],
    done: &[LevelRuns],
) -> Result<(), WorkflowError> {
    let row = |level: usize, record: &RunRecord, reason: &str| {
        let place = if level == 0 { String::new() } else { format!("on level {}: ", level + 1) };
        let values = record.inputs.iter().map(f64::to_string);
        let rest = [format!("{:.3}", record.seconds), format!("{place}{reason}")];
        [record.id.to_string()].into_iter().chain(values).chain(rest).collect::<Vec<_>>()
    };
    let rows = done.iter().enumerate().flat_map(|(level, runs)| {
        runs.failed().map(move |(record, reason)| row(level, record, reason))
    });
    let header =
        ["run"].into_iter().chain(names.iter().map(String::as_str)).chain(["seconds", "reason"]);
    task.write_csv("failed_runs.csv", header, rows)
}
