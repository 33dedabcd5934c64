//! Stage `calibrate` of a case with several tests: joint posterior of all tests, and the posterior without each test.

use std::collections::BTreeMap;

use ppl::Posterior;

use super::evidence::TestEvidence;
use super::folders;
use super::model_file::write_model;
use super::parameters::{FILE, JointParameter, path_and_test};
use super::sources::write_uncertainty;
use crate::case::{
    BetweenTestsCase, CaseFile, SingleTest, TrendCase, TrendValues, TrendVariable, validation_case,
};
use crate::error::InputError;
use crate::forward::prior_sensitivity::{write_evidence, write_sensitivity};
use crate::fracture::{BetweenTests, JointCalibration, JointTest, TrendOverTests, calibrate_tests};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::stages::calibrate::{ChainsBar, write_draws, write_sampling, write_summary};

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let tests = TestEvidence::read_all(inputs, task.accept_out_of_range)?;
    let settings = inputs.calibration();
    let sampler = settings.sampler(task.interrupt);
    let burn_in = settings.burn_in_draws();
    let between = relations(inputs)?;
    let all: Vec<JointTest> = tests.iter().map(TestEvidence::joint_test).collect();
    let calibrated = |tests: &[JointTest], label: &str| {
        let between = &relations_in(&between, tests);
        let bar = ChainsBar::new(settings.chains, label);
        let result = task.on_threads(settings.chains, |threads| {
            let shown = sampler.clone().threads(threads).progress(&bar);
            calibrate_tests(tests, between, &shown, burn_in, settings.seed)
        });
        drop(bar);
        task.check_interrupt()?;
        Ok::<JointCalibration, WorkflowError>(result?)
    };
    write_model(task, &all, &between)?;
    let joint = calibrated(&all, "draws of all tests")?;
    if !joint.mode.converged {
        let mode = &joint.mode;
        let text = format!(
            "the mode is uncertain: only {} of {} searches found it",
            mode.agreeing, mode.starts
        );
        say("note", &text);
    }
    write_posterior(task, &joint)?;
    for (test, draws) in tests.iter().zip(&joint.tests) {
        task.write_json(&folders::draws_of(&test.name), draws)?;
    }
    write_draws_of_new_tests(task, &joint)?;
    write_sensitivity(task, joint.prior_sensitivity())?;
    write_evidence(task, |seed| joint.marginal_likelihood(seed))?;
    write_map(task, &joint)?;
    write_uncertainty(task, &tests, &joint)?;

    let mut without = Vec::new();
    for left_out in tests.iter().map(|test| &test.name).filter(|_| tests.len() > 1) {
        say("calibrate", &format!("without {left_out}"));
        let others: Vec<JointTest> =
            all.iter().filter(|test| test.name != *left_out).cloned().collect();
        without
            .push((left_out.clone(), calibrated(&others, &format!("draws without {left_out}"))?));
    }
    write_without_tests(task, &joint, &without)?;
    let posterior = &joint.posterior;
    Ok(format!(
        "{} tests, {} specimens, {} draws in {} chains, {} divergences",
        tests.len(),
        tests.iter().map(|test| test.specimens).sum::<usize>(),
        posterior.posterior.chains * posterior.posterior.draws,
        posterior.posterior.chains,
        posterior.chains.divergences()
    ))
}

/// Relation between the values of each parameter in the tests, by the path of the parameter.
///
/// # Errors
/// Fails if a test has no value of the variable of a trend.
fn relations(inputs: &Inputs<'_>) -> Result<BTreeMap<String, BetweenTests>, WorkflowError> {
    let tests = inputs.tests()?;
    let relation = |relation: &BetweenTestsCase| -> Result<BetweenTests, WorkflowError> {
        Ok(match *relation {
            BetweenTestsCase::Shared => BetweenTests::Shared,
            BetweenTestsCase::Own => BetweenTests::Own,
            BetweenTestsCase::VariesPercent(percent) => {
                BetweenTests::Varies { scale: 0.01 * percent }
            }
            BetweenTestsCase::Trend(TrendCase { trend, deviation_percent }) => {
                // the check of the case refuses tests without a value
                let no_value = |test| {
                    WorkflowError::Unusable(format!("the test {test} has no value of a trend"))
                };
                let TrendValues { at, unit } = trend.values(&tests).map_err(no_value)?;
                BetweenTests::Trend(TrendOverTests {
                    at,
                    is_logarithmic: trend == TrendVariable::Rate,
                    unit: unit.to_owned(),
                    deviation: 0.01 * deviation_percent,
                })
            }
        })
    };
    let all = inputs.calibration().between_tests.iter();
    all.map(|(parameter, entry)| Ok((parameter.to_string(), relation(entry)?))).collect()
}

/// Writes the draws at which each validation simulates its test, and the draws in each candidate for a further test. The
/// parameters have their values in the test that the entry changes, with two exceptions: varying parameters have new
/// values about their centre, and trends are evaluated at the temperature or rate of the entry.
fn write_draws_of_new_tests(
    task: &Task<'_>,
    joint: &JointCalibration,
) -> Result<(), WorkflowError> {
    let tests = task.inputs.tests()?;
    let settings = task.inputs.calibration();
    for (index, test) in tests.iter().enumerate() {
        let draws = |name: &str, file: CaseFile| {
            let own = SingleTest { name: name.to_owned(), file, own: test.own.clone() };
            let mut at = BTreeMap::new();
            for (parameter, relation) in settings.between_tests.iter() {
                let BetweenTestsCase::Trend(trend) = relation else { continue };
                let value = trend.trend.value_in(&own, &tests).map_err(WorkflowError::Unusable)?;
                at.insert(parameter.to_string(), value);
            }
            Ok::<_, WorkflowError>(joint.draws_in_new_test(index, &at, settings.seed))
        };
        for (place, entry) in test.file.case.validation.iter().enumerate() {
            let unreadable = |mut errors: Vec<InputError>| match errors.is_empty() {
                true => WorkflowError::Unusable(format!("{}: mistakes", entry.name)),
                false => errors.swap_remove(0).into(),
            };
            let file = validation_case(&test.file, entry, place).map_err(unreadable)?;
            let name = folders::draws_of_validation(&entry.name);
            task.write_json(&name, &draws(&entry.name, file)?)?;
        }
        for (number, entry) in (1..).zip(&test.file.case.further_tests.candidate) {
            let file = test.file.of_candidate(entry)?;
            let name = folders::draws_of_candidate(&test.name, number);
            task.write_json(&name, &draws(&entry.name, file)?)?;
        }
    }
    Ok(())
}

/// Returns the relations of the parameters that at least one of the given tests shares with other
/// tests.
fn relations_in(
    between: &BTreeMap<String, BetweenTests>,
    tests: &[JointTest],
) -> BTreeMap<String, BetweenTests> {
    let shares = |test: &JointTest, name: &String| {
        test.forward.inputs().iter().any(|input| input.name == *name) && !test.own.contains(name)
    };
    let is_shared = |name: &String| tests.iter().any(|test| shares(test, name));
    let shared = between.iter().filter(|(name, _)| is_shared(name));
    shared.map(|(name, relation)| (name.clone(), relation.clone())).collect()
}

/// Writes draws, summary and statistics of the sampler, and the warnings about the posterior.
fn write_posterior(task: &Task<'_>, joint: &JointCalibration) -> Result<(), WorkflowError> {
    let posterior = &joint.posterior;
    let named = |name: &str, e| WorkflowError::io(&task.path(name), e);
    task.product("posterior.zarr", |path| {
        posterior.write_zarr(path).map_err(|e| named("posterior.zarr", e))
    })?;
    let shown = without_coordinates(posterior);
    write_draws(task, &shown)?;
    let mut summary = shown.summary();
    // the likelihood of a test is one term of the density, which counts as an observation without data
    let warnings = write_summary(task, &mut summary, joint.names.iter().map(String::as_str))?;
    warnings.iter().for_each(|warning| task.warn(warning));
    write_sampling(task, posterior)?;
    let parameter =
        |(name, prior): (&String, &_)| JointParameter { name: name.clone(), prior: *prior };
    let parameters: Vec<JointParameter> =
        joint.names.iter().zip(&joint.priors).map(parameter).collect();
    task.write_json(FILE, &parameters)
}

/// Returns the posterior without the standardised deviations and the partial correlations. Both are internal
/// coordinates of the sampler. The tables for users contain the values of the parameters in the tests, and the
/// correlations, instead.
fn without_coordinates(posterior: &Posterior) -> Posterior {
    let is_shown = |name: &str| !matches!(name, "unit" | "partial");
    let mut shown = posterior.clone();
    shown.layout.variables.retain(|variable| is_shown(&variable.name));
    for group in [&mut shown.posterior].into_iter().chain(&mut shown.prior) {
        group.variables.retain(|values| is_shown(&values.name));
    }
    shown
}

/// Writes the mode, and the true medians of virtual specimens, if they are equal in all tests that have the parameter.
fn write_map(task: &Task<'_>, joint: &JointCalibration) -> Result<(), WorkflowError> {
    let tests = task.inputs.tests()?;
    let truth = |name: &str| {
        let (path, only) = path_and_test(name);
        let tests = tests.iter().filter(|test| only.is_none_or(|only| only == test.name));
        let virtual_specimens = tests
            .filter_map(|test| test.file.case.experiments.as_ref()?.virtual_specimens.as_ref());
        let mut values = virtual_specimens.flat_map(|specimens| {
            let truths = specimens.truth.iter();
            truths.filter(|(parameter, _)| parameter.to_string() == path).map(|(_, truth)| *truth)
        });
        let first = values.next()?;
        values.all(|value| value == first).then_some(first)
    };
    let rows = joint.names.iter().zip(&joint.map).map(|(name, map)| {
        let truth = truth(name).map(|truth| truth.to_string()).unwrap_or_default();
        [name.clone(), map.to_string(), truth]
    });
    task.write_csv("map.csv", ["parameter", "map", "truth"], rows)
}

/// Writes `without_tests.csv`: the posterior of each parameter without each test. A parameter that only the omitted test
/// has is skipped.
fn write_without_tests(
    task: &Task<'_>,
    joint: &JointCalibration,
    without: &[(String, JointCalibration)],
) -> Result<(), WorkflowError> {
    let mut rows = Vec::new();
    for (k, (name, prior)) in joint.names.iter().zip(&joint.priors).enumerate() {
        let all = Moments::of(joint, k);
        for (left_out, others) in without {
            let Some(index) = others.names.iter().position(|other| other == name) else { continue };
            let moments = Moments::of(others, index);
            let statistics = [
                moments.mean,
                moments.sd,
                moments.quantiles[0],
                moments.quantiles[1],
                moments.contraction(prior.sd()),
                (moments.mean - all.mean) / all.sd,
                moments.sd / all.sd,
            ];
            let cells = [name.clone(), left_out.clone()].into_iter();
            rows.push(cells.chain(statistics.map(|x| x.to_string())).collect::<Vec<_>>());
        }
    }
    let header =
        ["parameter", "without", "mean", "sd", "q05", "q95", "contraction", "shift_sd", "sd_ratio"];
    task.write_csv("without_tests.csv", header, rows)
}

/// Moments and quantiles of the draws of one parameter.
struct Moments {
    mean: f64,
    sd: f64,
    quantiles: [f64; 2],
}

impl Moments {
    fn of(joint: &JointCalibration, parameter: usize) -> Self {
        let trace = joint.posterior.trace(&format!("theta[{parameter}]")).unwrap_or_default();
        let mut draws = trace.concat();
        draws.sort_by(f64::total_cmp);
        let n = draws.len().max(1) as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let quantile = |p: f64| {
            let at = (p * (n - 1.0)).round() as usize;
            draws.get(at).copied().unwrap_or(f64::NAN)
        };
        Self { mean, sd: variance.sqrt(), quantiles: [quantile(0.05), quantile(0.95)] }
    }

    /// 1 − posterior variance / prior variance.
    fn contraction(&self, prior_sd: f64) -> f64 {
        1.0 - (self.sd / prior_sd).powi(2)
    }
}
