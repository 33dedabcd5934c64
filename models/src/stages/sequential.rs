//! Batches of runs that are added in the region of the posterior.
//!
//! After the runs of the design and after each batch, a surrogate is fitted and the parameters are calibrated as in the
//! later stages, but with fewer draws. The result is called a *look*: it contains the contributions to the uncertainty,
//! and the points of the next batch. Looks are stored in the folder of the batches' runs, so that a resumed run, or
//! another process, continues with the same points. A look does not record whether it is the last look. Therefore a
//! smaller `share` or a larger `most` continues the existing runs and looks.

use std::path::{Path, PathBuf};

use fem::{RunInput, RunRecord};
use serde::{Deserialize, Serialize};
use surrogate::{Dataset, FitReport};

use crate::case::{CalibrationCase, SequentialCase};
use crate::forward::fitted::{Fitted, read_experiments};
use crate::forward::specimen_stiffness::of_specimens;
use crate::forward::uncertainty::{Budget, OF_SURROGATE, SharedError, budget, draws_of};
use crate::fracture::{column_means, sample};
use crate::pipeline::gate::is_in_range;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::neighbours::Neighbours;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::locks::lock;
use crate::runs::ensemble_runs::folder_of_runs;
use crate::runs::level_runs::{FOLDER, LevelRuns, Runner};
use crate::specimen::levels::Level;

/// Number of posterior draws from which the points of a batch are chosen.
const CANDIDATES: usize = 500;

/// Upper limit of draws per chain in a calibration that only places a batch.
const MOST_DRAWS: usize = 1000;

/// Batches of a case: settings of `[sequential]`, and the folder of the batches' runs.
pub(crate) struct Batches<'a> {
    case: SequentialCase,
    /// Level whose key identifies the runs of the batches.
    level: Level<'a>,
    folder: PathBuf,
    /// Number of the first run of the first batch.
    first: usize,
}

/// Runs with their quantities, and the fit reports of the corrections.
type Learnt = (Dataset, Vec<FitReport>);

/// Look: result of an intermediate calibration to the runs made so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Look {
    /// Number of runs with quantities.
    runs: usize,
    parameters: Vec<String>,
    /// Contraction of each parameter: 1 − variance of the posterior / variance of the prior.
    contractions: Vec<f64>,
    /// Surrogate's share of the posterior variance of each parameter.
    shares: Vec<f64>,
    /// Surrogate's largest share of the posterior variance, among the parameters that the data identify.
    largest: f64,
    /// Inputs of the runs of the next batch.
    next: Vec<Vec<f64>>,
}

/// Keys of the case on which the points of the batches depend, besides the runs of the design.
const KEYS_OF_BATCHES: [&str; 6] =
    ["qoi", "calibration", "surrogate", "extend", "fidelity", "sequential.batch"];

/// Name of the file of look (intermediate calibration) number `k`, from 0.
fn name_of_look(k: usize) -> String {
    format!("look-{k:02}.json")
}

/// Reads a stored look (intermediate calibration). Returns `None` if the file cannot be read; the look is then computed
/// again.
fn read_look(path: &Path) -> Option<Look> {
    serde_json::from_slice(&fem::read_regular(path).ok()?).ok()
}

impl<'a> Batches<'a> {
    /// Returns the batches of a case; `None` without `[sequential]`. `runs` is the number of the last run of the
    /// design.
    ///
    /// # Errors
    /// Fails if `experiments.csv` is missing.
    pub(crate) fn of(
        inputs: &Inputs<'_>,
        level: &Level<'a>,
        dir: &Path,
        runs: usize,
    ) -> Result<Option<Self>, WorkflowError> {
        let Some(batch) = inputs.sequential_batch() else { return Ok(None) };
        inputs.file("experiments.csv")?;
        let key = level.key.with(&format!("batches of {batch}\n"));
        let key = key.and(inputs, &KEYS_OF_BATCHES, &["experiments.csv"]);
        let level = level.named(key, "runs in batches");
        let Some(case) = inputs.sequential().clone() else { return Ok(None) };
        let folder = folder_of_runs(dir, Neighbours::of(dir).as_ref(), FOLDER, &level.key);
        Ok(Some(Self { case, level, folder, first: runs + 1 }))
    }

    /// Maximum number of runs of all batches.
    pub(crate) fn most(&self) -> usize {
        self.case.most / self.case.batch * self.case.batch
    }

    /// Number of the batch to which a run belongs, from 1; `None` for runs of the design.
    pub(crate) fn batch_of(&self, run: usize) -> Option<usize> {
        Some(1 + run.checked_sub(self.first)? / self.case.batch)
    }

    /// Reads the stored looks (intermediate calibrations).
    pub(crate) fn looks(&self) -> Vec<Look> {
        (0..).map_while(|k| read_look(&self.folder.join(name_of_look(k)))).collect()
    }

    /// Number of runs in batches whose points have been chosen, and the folder of these runs.
    pub(crate) fn chosen_runs(&self) -> (usize, &PathBuf) {
        let batches = self.looks().iter().filter(|look| self.goes_on(look)).count();
        ((batches * self.case.batch).min(self.most()), &self.folder)
    }

    /// Whether another batch follows a look (intermediate calibration). The maximum number of runs is not checked here.
    fn goes_on(&self, look: &Look) -> bool {
        look.largest > self.case.share && !look.next.is_empty()
    }

    /// Computes batches until the surrogate's share is at most `sequential.share`, or until the maximum number of runs
    /// is reached. `data` returns the dataset of the runs on the first level and the fit reports of the corrections.
    ///
    /// # Errors
    /// The error of a run, a fit or a calibration.
    pub(crate) fn make(
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

    /// Returns look (intermediate calibration) number `k`: the stored look, or a new look, which only one of several
    /// processes computes. Returns `None` if the data are outside the range of the runs; the stage `calibrate` reports
    /// this error later.
    fn look(
        &self,
        task: &Task<'_>,
        k: usize,
        data: &mut dyn FnMut() -> Result<Learnt, WorkflowError>,
    ) -> Result<Option<Look>, WorkflowError> {
        if let Some(look) = self.stored_look(k, task)? {
            return Ok(Some(look));
        }
        let _lock = lock(&self.folder, "looks", task.stage(), task.interrupt)?;
        if let Some(look) = self.stored_look(k, task)? {
            return Ok(Some(look));
        }
        let (runs, corrections) = data()?;
        let new_look = self.calibrated(task, &runs, corrections)?;
        if let Some(look) = &new_look {
            let (name, folder) = (name_of_look(k), task.folder.with_dir(&self.folder));
            let text = serde_json::to_vec_pretty(look);
            let text = text.map_err(|e| WorkflowError::io(&folder.path(&name), e.into()))?;
            folder.write(&name, task.stage(), &text)?;
            say(task.stage(), &look.words(runs.len()));
        }
        Ok(new_look)
    }

    /// Reads look (intermediate calibration) number `k`, if it is stored. Fails if the user has changed its file.
    fn stored_look(&self, k: usize, task: &Task<'_>) -> Result<Option<Look>, WorkflowError> {
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
            say(
                "note",
                "the next batch of runs cannot be chosen: the means of the specimens are outside the range of the runs",
            );
            return Ok(None);
        }
        let fitted = Fitted::of(runs, &of_specimens(inputs)?, inputs.surrogate(), corrections)?;
        let shared = SharedError::of(&fitted, &settings.discrepancy, &means)?;
        let evidence = shared.evidence(specimens, &fitted.known_stiffness);
        let priors = inputs.priors()?;
        let (warmup, draws) = (settings.warmup.min(MOST_DRAWS), settings.draws.min(MOST_DRAWS));
        let brief = CalibrationCase { warmup, draws, ..settings.storing_all_draws() };
        let sampler = brief.sampler(task.interrupt);
        let posterior = task.on_threads(settings.chains, |threads| {
            sample(&fitted.pce, &priors, &evidence, &sampler.threads(threads), settings.seed)
        });
        task.check_interrupt()?;
        let posterior = posterior?;
        let Some(budget) = budget(&fitted, &priors, &posterior, &evidence, &shared)? else {
            let message = "the sum of the scatter between specimens and the shared error is not positive definite";
            return Err(WorkflowError::Unusable(message.to_owned()));
        };
        let draws = draws_of(&posterior, "theta");
        let known_inputs = evidence.middle();
        let some = draws.iter().step_by(draws.len().div_ceil(CANDIDATES).max(1));
        let places: Vec<Vec<f64>> =
            some.map(|draw| [&draw[..], &known_inputs[..]].concat()).collect();
        let size = fitted.unknown().len();
        let chosen = fitted.coefficients.placement(&places, self.case.batch)?;
        let next = chosen.into_iter().map(|i| places[i][..size].to_vec()).collect();
        let Budget { parameters, contractions, .. } = &budget;
        Ok(Some(Look {
            runs: runs.len(),
            parameters: parameters.clone(),
            contractions: contractions.clone(),
            shares: budget.shares_of(OF_SURROGATE),
            largest: budget.largest_share().map_or(0.0, |(_, share)| share),
            next,
        }))
    }

    /// Writes `sequential.csv`, and prints a note if the surrogate's share is still above the limit.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub(crate) fn write(&self, task: &Task<'_>, looks: &[Look]) -> Result<(), WorkflowError> {
        let rows = looks.iter().enumerate().flat_map(|(k, look)| {
            let statistics = look.contractions.iter().zip(&look.shares);
            look.parameters.iter().zip(statistics).map(move |(parameter, (contraction, share))| {
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
                    "sequential.most = {most} runs have been made, and the surrogate's share is {:.1} %, above \
                     sequential.share = {share}: raise `most` to add runs, or accept the present share",
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
