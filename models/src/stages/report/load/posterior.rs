//! Loads the posterior: parameters, all sampled quantities, and the contributions to the
//! uncertainty.

use ppl::diagnostics::{mcse_mean, mcse_quantile, mcse_sd};
use surrogate::Dataset;

use crate::case::{Case, Parameter};
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::report::{CalibratedParameter, LeftOut, ParameterSensitivity, Summarised};
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

/// Columns of the summary in the order in which the report shows them.
const MOMENTS: [&str; 5] = ["mean", "sd", "q05", "q50", "q95"];

/// Loads the calibrated parameters with their draws and the points of the design. `label` returns the label of a
/// parameter from its path.
///
/// # Errors
/// Fails if a result is missing or cannot be read.
pub(crate) fn parameters(
    inputs: &Inputs<'_>,
    data: &Dataset,
    label: &dyn Fn(&str) -> String,
) -> Result<Vec<CalibratedParameter>, WorkflowError> {
    let [draws, summary, map] = ["posterior.csv", "summary.csv", "map.csv"].map(|f| inputs.file(f));
    let (draws, summary, map) = (draws?, summary?, map?);
    let draws = CsvTable::read(&draws, &["chain"])?;
    let summary = CsvTable::read(&summary, &["parameter", "contraction"])?;
    let map = CsvTable::read(&map, &["parameter", "map"])?;
    let out_of_range = is_out_of_range(inputs)?;
    let mut parameters = Vec::new();
    for (i, (input, prior)) in data.inputs().iter().zip(inputs.priors()?).enumerate() {
        let name = &input.name;
        let chains = chains(&draws, name)?;
        let [mean, sd, q05, _, q95] = moments(&summary, name, &chains)?;
        parameters.push(CalibratedParameter {
            label: label(name),
            prior,
            design: data.rows().map(|(x, _)| x[i]).collect(),
            chains,
            mean,
            sd,
            q05,
            q95,
            contraction: summary.named("parameter", name)?.number("contraction")?,
            map: map.named("parameter", name)?.number("map")?,
            truth: map.named("parameter", name)?.text("truth").parse().ok(),
            out_of_range,
            ..CalibratedParameter::default()
        });
    }
    Ok(parameters)
}

/// Loads the influence of the priors on the parameters; empty if there is no file. `label` returns the label of a parameter from its
/// name.
pub(crate) fn sensitivities(
    inputs: &Inputs<'_>,
    label: &dyn Fn(&str) -> String,
) -> Result<Vec<ParameterSensitivity>, WorkflowError> {
    let Some(path) = inputs.file_if_there("sensitivity.csv") else { return Ok(Vec::new()) };
    let columns = ["parameter", "prior", "scatter_prior", "likelihood", "diagnosis"];
    let table = CsvTable::read(&path, &columns)?;
    let one = |row: TableRow<'_>| {
        let [prior, scatter, likelihood] = ["prior", "scatter_prior", "likelihood"];
        Ok(ParameterSensitivity {
            label: label(row.text("parameter")),
            sensitivities: [row.number(prior)?, row.number(scatter)?, row.number(likelihood)?],
            diagnosis: row.text("diagnosis").to_owned(),
        })
    };
    Ok(table.rows().map(one).collect::<Result<_, InputError>>()?)
}

/// Loads the logarithm of the marginal likelihood and its error; `None` if it was not estimated.
pub(crate) fn evidence(inputs: &Inputs<'_>) -> Result<Option<[f64; 2]>, WorkflowError> {
    let Some(path) = inputs.file_if_there("evidence.csv") else { return Ok(None) };
    let table = CsvTable::read(&path, &["ln_evidence", "error"])?;
    let estimate =
        |row: TableRow<'_>| Some([row.number("ln_evidence").ok()?, row.number("error").ok()?]);
    Ok(table.rows().next().and_then(estimate))
}

/// Label of a parameter, from its path.
pub(super) fn label_of(case: &Case, name: &str) -> String {
    let parameter_of_name: Option<Parameter> =
        case.parameter(name).cloned().or_else(|| name.parse().ok());
    parameter_of_name.map_or_else(|| name.to_owned(), |parameter| label(case, &parameter))
}

/// Name and unit of a parameter, with its region if parameters of several regions are calibrated.
fn label(case: &Case, parameter: &Parameter) -> String {
    let all = || case.prior.iter().flat_map(|prior| prior.parameters());
    parameter.label_and_unit(all().any(|other| other.region() != parameter.region()))
}

/// Draws of one column, for each chain.
fn chains(draws: &CsvTable<'_>, name: &str) -> Result<Vec<Vec<f64>>, InputError> {
    let mut chains: Vec<Vec<f64>> = Vec::new();
    for row in draws.rows() {
        let chain = row.number("chain")?;
        // the draws of a chain are contiguous, and chains are in order
        if chain != chains.len() as f64 && chain + 1.0 != chains.len() as f64 {
            let help = "Run `breccia calibrate` again.";
            return Err(row.error("chain", "is not a chain of this case", help));
        }
        if chain == chains.len() as f64 {
            chains.push(Vec::new());
        }
        if let Some(last) = chains.last_mut() {
            last.push(row.number(name)?);
        }
    }
    Ok(chains)
}

/// Mean, standard deviation and quantiles from the summary, each with its Monte Carlo error computed from `chains`.
fn moments(
    summary: &CsvTable<'_>,
    name: &str,
    chains: &[Vec<f64>],
) -> Result<[(f64, f64); 5], InputError> {
    let row = summary.named("parameter", name)?;
    let chains: Vec<&[f64]> = chains.iter().map(Vec::as_slice).collect();
    let errors = [
        mcse_mean(&chains),
        mcse_sd(&chains),
        mcse_quantile(&chains, 0.05),
        mcse_quantile(&chains, 0.5),
        mcse_quantile(&chains, 0.95),
    ];
    let mut moments = [(0.0, 0.0); 5];
    for ((moment, column), error) in moments.iter_mut().zip(MOMENTS).zip(errors) {
        *moment = (row.number(column)?, error);
    }
    Ok(moments)
}

/// Loads the summary of every sampled quantity.
pub(crate) fn summary(inputs: &Inputs<'_>) -> Result<Vec<Summarised>, WorkflowError> {
    let (draws, summary) = (inputs.file("posterior.csv")?, inputs.file("summary.csv")?);
    let draws = CsvTable::read(&draws, &["chain"])?;
    let summary = CsvTable::read(&summary, &["parameter"])?;
    let mut rows = Vec::new();
    for row in summary.rows() {
        let name = row.text("parameter");
        let number = |column: &str| row.text(column).parse().unwrap_or(f64::NAN);
        rows.push(Summarised {
            moments: moments(&summary, name, &chains(&draws, name)?)?,
            name: name.to_owned(),
            rhat: number("rhat"),
            ess_bulk: number("ess_bulk"),
            ess_tail: number("ess_tail"),
        });
    }
    Ok(rows)
}

/// Number of divergent transitions after warmup, in all chains.
pub(crate) fn divergences(inputs: &Inputs<'_>) -> Result<u64, WorkflowError> {
    let path = inputs.file("sampling.csv")?;
    let table = CsvTable::read(&path, &["divergences"])?;
    let counts = table.rows().map(|row| row.number("divergences"));
    Ok(counts.sum::<Result<f64, _>>()? as u64)
}

/// Loads for each specimen its expected log predictive density (elpd) given the other specimens, and the parameter that
/// shifts most if the specimen is left out; empty if the files do not exist.
pub(super) fn left_out(inputs: &Inputs<'_>, case: &Case) -> Result<Vec<LeftOut>, WorkflowError> {
    let files = ["loo.csv", "influence.csv"].map(|name| inputs.file_if_there(name));
    let [Some(loo), Some(influence)] = files else { return Ok(Vec::new()) };
    let loo = CsvTable::read(&loo, &["specimen", "elpd", "pareto_k"])?;
    let columns = ["specimen", "parameter", "shift_sd", "method"];
    let influence = CsvTable::read(&influence, &columns)?;
    let mut rows = Vec::new();
    for row in loo.rows() {
        let specimen = row.text("specimen").to_owned();
        let mut one = LeftOut {
            elpd: row.number("elpd")?,
            // infinite if no tail can be fitted
            pareto_k: row.text("pareto_k").parse().unwrap_or(f64::NAN),
            specimen,
            ..LeftOut::default()
        };
        for shift_row in
            influence.rows().filter(|shift_row| shift_row.text("specimen") == one.specimen)
        {
            let shift = shift_row.number("shift_sd")?;
            one.is_sampled = shift_row.text("method") == "sampled";
            if one.moved.as_ref().is_none_or(|(_, largest)| shift.abs() > largest.abs()) {
                one.moved = Some((label_of(case, shift_row.text("parameter")), shift));
            }
        }
        rows.push(one);
    }
    Ok(rows)
}

/// Label of a parameter, with the share of each source in its variance.
type Shares = (String, Vec<(String, f64)>);

/// Loads the contributions to the uncertainty of each parameter, in the order of the file.
pub(super) fn budget(inputs: &Inputs<'_>, case: &Case) -> Result<Vec<Shares>, WorkflowError> {
    let Some(path) = inputs.file_if_there("uncertainty.csv") else { return Ok(Vec::new()) };
    let table = CsvTable::read(&path, &["parameter", "source", "share"])?;
    let mut budget: Vec<Shares> = Vec::new();
    for row in table.rows() {
        let name = row.text("parameter");
        let label = label_of(case, name);
        let part = (row.text("source").to_owned(), row.number("share")?);
        match budget.last_mut() {
            Some((parameter, sources)) if *parameter == label => sources.push(part),
            _ => budget.push((label, vec![part])),
        }
    }
    Ok(budget)
}

/// Whether the calibration was made with data outside the range of the simulations.
fn is_out_of_range(inputs: &Inputs<'_>) -> Result<bool, WorkflowError> {
    let path = inputs.file("range.csv")?;
    let table = CsvTable::read(&path, &["inside"])?;
    Ok(table.rows().any(|row| row.text("inside") != "true"))
}
