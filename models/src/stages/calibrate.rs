//! Stage `calibrate`: posterior and posterior mode (MAP), computed with the surrogate.

use std::borrow::Cow;
use std::sync::Mutex;

use ppl::diagnostics::e_bfmi;
use ppl::{ChainStatus, Posterior, Progress, Summary, WarningKind};
use surrogate::Input;

use crate::experiments::{experiment_inputs, virtual_inputs};
use crate::forward::extension::offers;
use crate::forward::fit::write_fit;
use crate::forward::fitted::{Fitted, read_experiments};
use crate::forward::influence::write_influence;
use crate::forward::predicted_curves::write_predicted_curves;
use crate::forward::prior_sensitivity::{write_evidence, write_sensitivity};
use crate::forward::uncertainty::{Budget, SharedError, budget};
use crate::fracture::{
    CalibrationError, TestDraws, calibrate_after, calibration_of_draws, column_means,
};
use crate::pipeline::gate::check_range;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::progress::{Bar, say};
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let fitted = Fitted::read(inputs)?;
    let pce = &fitted.pce;
    let (prior, priors) = (inputs.prior()?, inputs.priors()?);
    if !pce.inputs().starts_with(&prior) {
        let path = task.path("surrogate.json");
        return Err(WorkflowError::OtherCase { path, stage: "surrogate" });
    }
    let specimens = read_experiments(inputs, pce.outputs())?;
    let outside = check_range(task, &specimens)?;
    let settings = inputs.calibration();
    let bar = ChainsBar::new(settings.chains, "draws");
    let sampler = settings.sampler(task.interrupt);
    let burn_in = settings.burn_in_draws();
    let means = column_means(&specimens);
    let shared = SharedError::of(&fitted, &settings.discrepancy, &means)?;
    fitted.known_stiffness.note.iter().for_each(|note| say("note", note));
    let evidence = shared.evidence(specimens, &fitted.known_stiffness);
    let result = match &settings.joint {
        Some(file) => {
            let draws = joint_draws(inputs, &file.to_string_lossy())?;
            calibration_of_draws(pce, &priors, &evidence, &draws)
        }
        None => task.on_threads(settings.chains, |threads| {
            let shown = sampler.clone().threads(threads).progress(&bar);
            calibrate_after(pce, &priors, &evidence, &shown, burn_in, settings.seed)
        }),
    };
    drop(bar);
    task.check_interrupt()?;
    let result = result?;
    if let Some(mode) = result.mode.as_ref().filter(|mode| !mode.converged) {
        say(
            "note",
            &format!(
                "the mode is uncertain: only {} of {} searches found it",
                mode.agreeing, mode.starts
            ),
        );
    }
    let ids = specimen_ids(inputs)?;
    let names: Vec<&str> = ids.iter().map(String::as_str).collect();
    let parameters = inputs.parameters_in_units()?;
    let units: Vec<Cow<'_, str>> = parameters.iter().map(|parameter| parameter.unit()).collect();
    let units: Vec<&str> = units.iter().map(|unit| &**unit).collect();
    let posterior = result.in_units(pce.outputs(), &names, &evidence.qois, &units);
    let posterior = &posterior.map_err(CalibrationError::Label)?;
    let named = |name: &str, e| WorkflowError::io(&task.path(name), e);
    task.product("posterior.zarr", |path| {
        posterior.write_zarr(path).map_err(|e| named("posterior.zarr", e))
    })?;
    write_draws(task, posterior)?;
    write_predictions(task, posterior, pce.outputs())?;
    if let Some(curve_note) = write_predicted_curves(task, pce, posterior, &evidence)? {
        say("note", &curve_note);
    }
    let mut summary = posterior.summary();
    summary.rows.retain(|row| is_for_people(posterior, &row.name));
    let names = prior.iter().map(|input| input.name.as_str());
    // empty groups are no mistake: usually the inputs of all specimens are known, or all are unknown
    let of_posterior = write_summary(task, &mut summary, names)?;
    let mut warnings = outside;
    warnings.extend(fitted.made_on.warning(inputs));
    warnings.extend(fitted.known_stiffness.warning.clone());
    if settings.joint.is_none() {
        // in a joint calibration, the joint stage reports the warnings about the draws
        warnings.extend(of_posterior);
    }
    task.on_threads(settings.chains, |threads| {
        write_influence(task, &result, &sampler.threads(threads), burn_in, &ids, &prior)
    })?;
    if settings.joint.is_none() {
        // for draws of several tests, the joint stage writes these files
        write_sensitivity(task, result.prior_sensitivity())?;
        write_evidence(task, |seed| result.marginal_likelihood(seed))?;
    }
    write_fit(task, &fitted, posterior, &evidence, &shared, &result.map)?;
    let budget = budget(&fitted, &priors, posterior, &evidence, &shared)?;
    if let Some(budget) = &budget {
        // in a joint calibration, the joint stage writes the shares of the joint posterior; this test alone does not
        // give these shares
        if settings.joint.is_none() {
            budget.write(task)?;
            warnings.extend(unreached(inputs, budget));
        }
        warnings.extend(budget.warning(&summary, pce.outputs(), &evidence));
    }
    let draws =
        |name: &str| posterior.trace(&format!("theta[{name}]")).unwrap_or_default().concat();
    let can_extend = !inputs.imports_runs();
    warnings.extend(offers(&prior, &priors, &draws, fitted.report.rows, can_extend));
    warnings.iter().for_each(|warning| task.warn(warning));
    write_sampling(task, posterior)?;
    write_map(task, &prior, &result.map)?;
    Ok(format!(
        "{} draws in {} chains, {} divergences",
        summary.draws * summary.chains,
        summary.chains,
        posterior.chains.divergences()
    ))
}

/// Reads the draws of a joint calibration of several tests.
fn joint_draws(inputs: &Inputs<'_>, file: &str) -> Result<TestDraws, WorkflowError> {
    match inputs.file_if_there(file) {
        Some(_) => inputs.json(file),
        None => {
            let path = inputs.folder().join(file);
            Err(WorkflowError::Missing { path, stage: "calibrate" })
        }
    }
}

/// Returns a warning if the surrogate's share of the posterior variance is larger than `sequential.share` allows.
fn unreached(inputs: &Inputs<'_>, budget: &Budget) -> Option<String> {
    let asked = inputs.sequential_share()?;
    let (parameter, share) = budget.largest_share()?;
    (share > asked).then(|| {
        format!(
            "The surrogate's share of the uncertainty of {parameter} is {:.1} %, above the {:.1} % of \
             sequential.share: raise sequential.most to add more runs.",
            100.0 * share,
            100.0 * asked
        )
    })
}

/// Writes the summary of a posterior with the paths of the `parameters` as names. Returns its warnings, except warnings
/// about observations without data, and removes them from the summary.
pub(crate) fn write_summary<'n>(
    task: &Task<'_>,
    summary: &mut Summary,
    parameters: impl Iterator<Item = &'n str> + Clone,
) -> Result<Vec<String>, WorkflowError> {
    for row in &mut summary.rows {
        row.name = parameter_name(&row.name);
        row.place.clone_from(&row.name);
    }
    summary.warnings.retain(|warning| warning.kind != WarningKind::NoData);
    task.product("summary.csv", |path| {
        summary.write_csv(path).map_err(|e| WorkflowError::io(&task.path("summary.csv"), e))
    })?;
    // the model's names of the parameters
    let plain = |text: String| {
        parameters.clone().fold(text, |text, name| text.replace(&format!("theta[{name}]"), name))
    };
    // the warnings of all stages are listed in summary.txt
    task.write("posterior.txt", plain(summary.tables().to_string()))?;
    Ok(summary.warnings.drain(..).map(|warning| plain(warning.to_string())).collect())
}

/// Extracts the path of a parameter from its name in the posterior, such as `theta[matrix.young_mpa]`.
pub(crate) fn parameter_name(name: &str) -> String {
    let path = name.strip_prefix("theta[").and_then(|rest| rest.strip_suffix(']'));
    path.unwrap_or(name).to_owned()
}

/// Writes the posterior mode and, for virtual specimens, the true medians of the parameters.
fn write_map(task: &Task<'_>, parameters: &[Input], map: &[f64]) -> Result<(), WorkflowError> {
    let truth = match experiment_inputs::are_specimens_virtual(&task.inputs)? {
        true => virtual_inputs::truth(&task.inputs)?
            .iter()
            .map(|(_, value)| value.to_string())
            .collect(),
        false => vec![String::new(); map.len()],
    };
    let rows = parameters.iter().zip(map).zip(truth);
    let rows = rows.map(|((input, map), truth)| [input.name.clone(), map.to_string(), truth]);
    task.write_csv("map.csv", ["parameter", "map", "truth"], rows)
}

/// Whether the scalar component `name` of the posterior belongs in a table for users. Excluded are the Cholesky factor
/// of the correlations, and the diagonal and one triangle of the symmetric correlation matrix.
fn is_for_people(posterior: &Posterior, name: &str) -> bool {
    let row_and_column = |quantity: &str| {
        let variable = posterior.layout.variables.iter().find(|v| v.name == quantity)?;
        let index = posterior.layout.labelled(variable).iter().position(|label| label == name)?;
        let columns = *variable.shape.last()?;
        Some((index / columns, index % columns))
    };
    row_and_column("corr").is_none()
        && row_and_column("correlation").is_none_or(|(row, column)| row > column)
}

/// Names of the specimens, in the order of their quantities.
fn specimen_ids(inputs: &Inputs<'_>) -> Result<Vec<String>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &["id"])?;
    Ok(table.rows().map(|row| row.text("id").to_owned()).collect())
}

/// Writes the predicted quantities of new specimens, one line per draw.
fn write_predictions(
    task: &Task<'_>,
    posterior: &Posterior,
    quantities: &[String],
) -> Result<(), WorkflowError> {
    let group = &posterior.predictive;
    let drawn = group.get("new_specimen").map_or(&[][..], |values| &values.data);
    let rows = drawn.chunks(quantities.len()).enumerate().map(|(row, values)| {
        let chain_and_draw = [row / group.draws, row % group.draws].map(|i| i.to_string());
        chain_and_draw.into_iter().chain(values.iter().map(f64::to_string)).collect::<Vec<_>>()
    });
    let quantities = quantities.iter().map(String::as_str);
    task.write_csv("predictive.csv", ["chain", "draw"].into_iter().chain(quantities), rows)
}

/// Writes the posterior draws: one line per draw, one column per scalar component of a variable.
pub(crate) fn write_draws(task: &Task<'_>, posterior: &Posterior) -> Result<(), WorkflowError> {
    let group = &posterior.posterior;
    let mut header = vec!["chain".to_owned(), "draw".to_owned()];
    for values in &group.variables {
        let variable = posterior.layout.variables.iter().find(|v| v.name == values.name);
        let names = variable.map_or_else(|| values.elements(), |v| posterior.layout.labelled(v));
        header.extend(names.iter().map(|name| parameter_name(name)));
    }
    let count = group.chains * group.draws;
    let rows = (0..count).map(|row| {
        let chain_and_draw = [row / group.draws, row % group.draws].map(|i| i.to_string());
        let values = group.variables.iter().flat_map(move |variable| {
            let size = variable.data.len() / count;
            variable.data[row * size..(row + 1) * size].iter().map(f64::to_string)
        });
        chain_and_draw.into_iter().chain(values).collect::<Vec<_>>()
    });
    task.write_csv("posterior.csv", header, rows)
}

/// Writes the statistics of the sampler, one line per chain.
pub(crate) fn write_sampling(task: &Task<'_>, posterior: &Posterior) -> Result<(), WorkflowError> {
    let rows = posterior.chains.chains.iter().enumerate().map(|(index, chain)| {
        let n = chain.stats.len() as f64;
        let mean = |f: &dyn Fn(&ppl::DrawStats) -> f64| chain.stats.iter().map(f).sum::<f64>() / n;
        let energies: Vec<f64> = chain.stats.iter().map(|s| s.energy).collect();
        [
            index as f64,
            n,
            mean(&|s| f64::from(u8::from(s.divergent))) * n,
            mean(&|s| s.acceptance),
            mean(&|s| s.step_size),
            mean(&|s| f64::from(s.leapfrogs)),
            e_bfmi(&energies),
        ]
        .map(|x| x.to_string())
    });
    let header =
        ["chain", "draws", "divergences", "acceptance", "step_size", "leapfrogs", "e_bfmi"];
    task.write_csv("sampling.csv", header, rows)
}

/// Progress bar for all chains together.
pub(crate) struct ChainsBar {
    bar: Bar,
    fractions: Mutex<Vec<(f64, u64)>>,
}

impl ChainsBar {
    /// Starts a bar at zero for a number of chains. `label` names the counted items.
    pub(crate) fn new(chains: usize, label: &str) -> Self {
        Self { bar: Bar::new("calibrate", label), fractions: Mutex::new(vec![(0.0, 0); chains]) }
    }
}

impl Progress for ChainsBar {
    fn update(&self, status: &ChainStatus) {
        let Ok(mut fractions) = self.fractions.lock() else { return };
        fractions[status.chain] = (status.done as f64 / status.total as f64, status.divergences);
        let done = fractions.iter().map(|s| s.0).sum::<f64>() / fractions.len() as f64;
        let divergences: u64 = fractions.iter().map(|s| s.1).sum();
        let rate = status.draws_per_second;
        self.bar.set(done, &format!("{rate:.0} draws/s a chain, {divergences} divergences"));
    }
}
