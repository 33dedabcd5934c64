//! Runs that are added where the posterior lives.
//!
//! After the runs of the design a surrogate is fitted and calibrated as the later stages do it, only shorter.
//! What that says of the uncertainty, and the places of the next batch, is a look; looks are kept beside the
//! runs of the batches, so that work that goes on, here or in another process, goes on with the same runs. Whether a
//! look is the last one is no part of it: with a smaller `share` or a larger `most` the same runs go on.

use std::path::{Path, PathBuf};

use fem::{RunInput, RunRecord};
use ppl::Nuts;
use serde::{Deserialize, Serialize};
use surrogate::{Dataset, FitReport};

use super::WorkflowError;
use super::fitted::{Fitted, read_experiments};
use super::gate::is_in_range;
use super::inputs::Inputs;
use super::level_runs::{FOLDER, LevelRuns, Runner};
use super::levels::Level;
use super::locks::lock;
use super::neighbours::Neighbours;
use super::runs::place;
use super::specimen_stiffness::of_specimens;
use super::task::Task;
use super::uncertainty::{Budget, OF_SURROGATE, SharedError, budget, draws_of};
use crate::case::SequentialCase;
use crate::fracture::{column_means, sample};
use crate::progress::say;

/// Draws among which the places of a batch are chosen.
const CANDIDATES: usize = 500;

/// A calibration that only says where to go is not longer than this, in draws a chain.
const MOST_DRAWS: usize = 1000;

/// What the case asks for, and where it is kept.
pub(super) struct Batches<'a> {
    case: SequentialCase,
    /// What its runs are named by.
    level: Level<'a>,
    folder: PathBuf,
    /// The number of the first run.
    first: usize,
}

/// Runs with their quantities, and how well corrections from them are known.
type Learnt = (Dataset, Vec<FitReport>);

/// What a calibration to the runs until then said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Look {
    /// Runs with quantities.
    runs: usize,
    parameters: Vec<String>,
    /// Of each parameter, 1 − variance of the posterior over that of the prior.
    contractions: Vec<f64>,
    /// Of each parameter, the surrogate's share of the variance.
    shares: Vec<f64>,
    /// The largest share of those that the data identify.
    largest: f64,
    /// Inputs of the next batch.
    next: Vec<Vec<f64>>,
}

/// The name of the file of the `k`-th look.
fn name_of_look(k: usize) -> String {
    format!("look-{k:02}.json")
}

/// A look as it is kept; none if the file cannot be read, so that it is made again.
fn read_look(path: &Path) -> Option<Look> {
    serde_json::from_slice(&fem::read_regular(path).ok()?).ok()
}

impl<'a> Batches<'a> {
    /// What a case asks for after the runs of its levels, of which the last has the number `runs`. To be
    /// called after all that names those runs is read; what this reads names those of the batches besides.
    ///
    /// # Errors
    /// No quantities of specimens.
    pub(super) fn of(
        inputs: &Inputs<'_>,
        level: &Level<'a>,
        dir: &Path,
        runs: usize,
    ) -> Result<Option<Self>, WorkflowError> {
        let Some(batch) = inputs.sequential_batch() else { return Ok(None) };
        inputs.file("experiments.csv")?;
        inputs.surrogate();
        inputs.calibration();
        let level = level.named(&format!("batches of {batch}\n{}", inputs.manifest()));
        let Some(case) = inputs.sequential().clone() else { return Ok(None) };
        let folder = place(dir, Neighbours::of(dir).as_ref(), FOLDER, &level.manifest);
        Ok(Some(Self { case, level, folder, first: runs + 1 }))
    }

    /// Runs that there will be at most.
    pub(super) fn most(&self) -> usize {
        self.case.most / self.case.batch * self.case.batch
    }

    /// The number of the batch of a run; none for those of the design.
    pub(super) fn batch_of(&self, run: usize) -> Option<usize> {
        Some(1 + run.checked_sub(self.first)? / self.case.batch)
    }

    /// The looks that are kept already.
    pub(super) fn looks(&self) -> Vec<Look> {
        (0..).map_while(|k| read_look(&self.folder.join(name_of_look(k)))).collect()
    }

    /// Runs of the batches that are known until now, and where they are.
    pub(super) fn known(&self) -> (usize, &PathBuf) {
        let batches = self.looks().iter().filter(|look| self.goes_on(look)).count();
        ((batches * self.case.batch).min(self.most()), &self.folder)
    }

    /// Whether another batch follows a look, so long as there may be more runs.
    fn goes_on(&self, look: &Look) -> bool {
        look.largest > self.case.share && !look.next.is_empty()
    }

    /// Makes batch after batch until the surrogate's share is as small as is asked for. `data` makes the runs
    /// with quantities from those of the first level, and says how well corrections from it are known.
    ///
    /// # Errors
    /// What stops a run, a fit or a calibration.
    pub(super) fn make(
        &self,
        runner: &Runner<'_>,
        done: &mut LevelRuns,
        data: &mut dyn FnMut(&LevelRuns) -> Result<Learnt, WorkflowError>,
    ) -> Result<Vec<Look>, WorkflowError> {
        let task = runner.task;
        let mut looks = Vec::new();
        loop {
            let k = looks.len();
            let look = self.look(task, k, &mut || data(done))?;
            let Some(look) = look else { break };
            let made = k * self.case.batch;
            let (goes_on, next) = (self.goes_on(&look), look.next.clone());
            looks.push(look);
            if !goes_on || made + self.case.batch > self.case.most {
                break;
            }
            let run = |(i, inputs)| RunInput { id: self.first + made + i, inputs };
            let runs: Vec<RunInput> = next.into_iter().enumerate().map(run).collect();
            let records: Vec<RunRecord> = runner.run(&self.level, &runs, true)?;
            let derivatives = self.level.setup.derivatives;
            done.extend(LevelRuns::new(records, task.inputs.qoi(), derivatives));
        }
        Ok(looks)
    }

    /// The `k`-th look: as it is kept, or else made; of several processes one makes it. None for data that
    /// the runs do not reach, which the calibration refuses.
    fn look(
        &self,
        task: &Task<'_>,
        k: usize,
        data: &mut dyn FnMut() -> Result<Learnt, WorkflowError>,
    ) -> Result<Option<Look>, WorkflowError> {
        if let Some(look) = self.kept(k, task)? {
            return Ok(Some(look));
        }
        let _lock = lock(&self.folder, "looks", task.stage(), task.interrupt)?;
        if let Some(look) = self.kept(k, task)? {
            return Ok(Some(look));
        }
        let (runs, corrections) = data()?;
        let found = self.calibrated(task, &runs, corrections)?;
        if let Some(look) = &found {
            let (name, folder) = (name_of_look(k), task.folder.with_dir(&self.folder));
            let text = serde_json::to_vec_pretty(look);
            let text = text.map_err(|e| WorkflowError::io(&folder.path(&name), e.into()))?;
            folder.write(&name, task.stage(), &text)?;
            say(task.stage(), &look.words(runs.len()));
        }
        Ok(found)
    }

    /// The `k`-th look as it was written; a look that the user has changed is refused.
    fn kept(&self, k: usize, task: &Task<'_>) -> Result<Option<Look>, WorkflowError> {
        let (name, folder) = (name_of_look(k), task.folder.with_dir(&self.folder));
        folder.claim(&name, task.stage())?;
        Ok(read_look(&folder.path(&name)))
    }

    fn calibrated(
        &self,
        task: &Task<'_>,
        runs: &Dataset,
        corrections: Vec<FitReport>,
    ) -> Result<Option<Look>, WorkflowError> {
        let (inputs, settings) = (&task.inputs, task.inputs.calibration());
        let specimens = read_experiments(inputs, runs.outputs())?;
        let means = column_means(&specimens);
        if !is_in_range(runs, &means) && !task.accept_out_of_range {
            say("note", "no batch is placed: the specimens' means lie outside what the runs reach");
            return Ok(None);
        }
        let fitted = Fitted::of(runs, &of_specimens(inputs)?, inputs.surrogate(), corrections)?;
        let shared = SharedError::of(&fitted, &settings.discrepancy, &means)?;
        let evidence = shared.evidence(specimens, &fitted.known);
        let sampler = Nuts::default()
            .chains(settings.chains)
            .warmup(settings.warmup.min(MOST_DRAWS))
            .draws(settings.draws.min(MOST_DRAWS))
            .target_accept(settings.target_accept)
            .seed(settings.seed)
            .interrupt(task.interrupt);
        let posterior = task.on_threads(settings.chains, |threads| {
            sample(&fitted.pce, &evidence, &sampler.threads(threads), settings.seed)
        });
        task.check_interrupt()?;
        let posterior = posterior?;
        let Some(budget) = budget(&fitted, &posterior, &evidence, &shared)? else {
            let message =
                "the covariance of what specimens share and differ by is not positive definite";
            return Err(WorkflowError::Unusable(message.to_owned()));
        };
        let draws = draws_of(&posterior, "theta");
        let known = evidence.middle();
        let some = draws.iter().step_by(draws.len().div_ceil(CANDIDATES).max(1));
        let places: Vec<Vec<f64>> = some.map(|draw| [&draw[..], &known[..]].concat()).collect();
        let size = fitted.unknown().len();
        let chosen = fitted.open.placement(&places, self.case.batch)?;
        let next = chosen.into_iter().map(|i| places[i][..size].to_vec()).collect();
        let Budget { parameters, contractions, .. } = &budget;
        Ok(Some(Look {
            runs: runs.len(),
            parameters: parameters.clone(),
            contractions: contractions.clone(),
            shares: budget.of(OF_SURROGATE),
            largest: budget.largest_share().map_or(0.0, |(_, share)| share),
            next,
        }))
    }

    /// Writes `sequential.csv`, and says how it ended.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&self, task: &Task<'_>, looks: &[Look]) -> Result<(), WorkflowError> {
        let rows = looks.iter().enumerate().flat_map(|(k, look)| {
            let numbers = look.contractions.iter().zip(&look.shares);
            look.parameters.iter().zip(numbers).map(move |(parameter, (contraction, share))| {
                let [k, runs] = [k, look.runs].map(|n| n.to_string());
                [k, runs, parameter.clone(), contraction.to_string(), share.to_string()]
            })
        });
        let header = ["batches", "runs", "parameter", "contraction", "surrogate_share"];
        task.write_csv("sequential.csv", header, rows)?;
        if let Some(last) = looks.last().filter(|look| self.goes_on(look)) {
            let SequentialCase { share, most, .. } = self.case;
            say(
                "note",
                &format!(
                    "sequential.most = {most} runs are made and the surrogate's share is {:.1} %, above \
                     sequential.share = {share}: raise `most` to go on, or take what is reached",
                    100.0 * last.largest
                ),
            );
        }
        Ok(())
    }
}

impl Look {
    fn words(&self, runs: usize) -> String {
        format!(
            "{runs} runs: the surrogate's share of the uncertainty is {:.1} %",
            100.0 * self.largest
        )
    }
}
