//! Candidate that takes further quantities from the existing curves of the present test. Because the curves exist, a
//! calibration to these quantities shows how much these quantities narrow the posterior.

use fem::RunRecord;
use ppl::Posterior;
use surrogate::DynPce;

use super::present::{at_draws, belief};
use crate::case::{CandidateCase, QoiComparison};
use crate::error::InputError;
use crate::experiments::experiment_inputs;
use crate::experiments::mesh_scale::MeshScale;
use crate::experiments::preparation::Preparation;
use crate::experiments::specimen_quantities::MeasuredQuantities;
use crate::forward::fitted::Fitted;
use crate::forward::posterior_draws::Draw;
use crate::forward::specimen_stiffness::of_specimens;
use crate::forward::uncertainty::SharedError;
use crate::fracture::{column_means, sample};
use crate::further_test::{Belief, FurtherTest};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::runs::level_runs::LevelRuns;
use crate::stages::ensemble::Plan;
use crate::table::CsvTable;

/// Calibrates to the compared quantities and the further quantities of the existing curves. Returns the resulting
/// belief about the parameters, and the test of more specimens with all these quantities.
pub(super) fn test(
    task: &Task<'_>,
    case: &CandidateCase,
    number: usize,
) -> Result<(Belief, FurtherTest), WorkflowError> {
    let inputs = &task.inputs;
    let plan = Plan::of(inputs, usize::MAX)?;
    let qoi = inputs.qoi();
    let quantities = case.measured(&qoi.quantities);
    let further = QoiComparison { quantities: quantities.clone(), ..*qoi };
    let done: Vec<LevelRuns> =
        plan.make(task)?.into_iter().map(|level| with_quantities(level, &further)).collect();
    let (data, corrections) = plan.learnt(inputs, &quantities, &done)?;
    let name = format!("next-test/candidate-{number}.csv");
    let table = data.to_csv().map_err(|e| WorkflowError::io(&task.path(&name), e))?;
    task.write(&name, table)?;
    let corrections: Vec<_> = corrections.iter().map(|one| one.report().clone()).collect();
    let fit = Fitted::of(&data, &of_specimens(inputs)?, inputs.surrogate(), corrections)?;

    let qois = read_again(inputs, &quantities)?;
    let means = column_means(&qois);
    let shared = SharedError::of(&fit, &inputs.calibration().discrepancy, &means)?;
    let evidence = shared.evidence(qois, &fit.known_stiffness);
    let seen = evidence.recorded();
    let (middle, shared) = (evidence.middle(), shared.total());
    let settings = inputs.calibration();
    let sampler = settings.storing_all_draws().sampler(task.interrupt).threads(task.threads);
    let priors = inputs.priors()?;
    let posterior = sample(&fit.pce, &priors, &evidence, &sampler, settings.seed);
    task.check_interrupt()?;
    let draws = draws(&posterior?, &fit.pce);
    let belief =
        belief(&priors, &draws).map_err(|error| WorkflowError::Unusable(error.to_string()))?;
    let draws = at_draws(&fit.pce, &middle, &draws, &|draw| draw.scatter.clone())?;
    Ok((belief, FurtherTest { draws, shared, seen, alike: None }))
}

/// Computes the quantities `qoi` of the runs of a level.
fn with_quantities(level: LevelRuns, qoi: &QoiComparison) -> LevelRuns {
    let derivatives = level.records.iter().any(|r: &RunRecord| !r.sensitivities.names.is_empty());
    LevelRuns::new(level.records, qoi, derivatives)
}

/// Computes the quantities of the specimens from their curves in the same way as the stage `experiments`; NaN for a quantity
/// that a curve cannot give.
///
/// # Errors
/// Fails if no curve can give one of the quantities.
fn read_again(
    inputs: &Inputs<'_>,
    quantities: &[Quantity],
) -> Result<Vec<Vec<f64>>, WorkflowError> {
    let preparation = Preparation::of(inputs);
    let specimens = experiment_inputs::specimen_table(inputs)?;
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &["id", MeshScale::COLUMNS[0], "slope_fraction"])?;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut missing = Vec::new();
    for row in table.rows() {
        let id = row.text("id");
        let Some(specimen) = specimens.specimens.iter().find(|specimen| specimen.id == id) else {
            let help = "Run `breccia experiments` again.";
            return Err(row.error("id", "is not a specimen of the table", help).into());
        };
        let fraction = row.number("slope_fraction")?;
        let (curve, _) = preparation.apply(&specimen.curve, fraction);
        let curve = MeshScale::of_row(row)?.apply(&curve);
        let measured = MeasuredQuantities::of(&curve, fraction, quantities);
        missing.extend(measured.missing.into_iter().map(|missing| (id.to_owned(), missing)));
        rows.push(measured.values);
    }
    for (m, quantity) in quantities.iter().enumerate() {
        if rows.iter().all(|row| row[m].is_nan())
            && let Some((id, (_, error))) = missing.iter().find(|(_, (own, _))| own == quantity)
        {
            let help = "Choose quantities that the measured curves reach.";
            return Err(InputError::new(&path, "id", id, error.to_string(), help).into());
        }
    }
    Ok(rows)
}

/// Converts a posterior in memory to draws.
fn draws(posterior: &Posterior, pce: &DynPce) -> Vec<Draw> {
    let group = &posterior.posterior;
    let values_of = |name: &str| {
        let values = group.variables.iter().find(|variable| variable.name == name);
        values.map_or(&[][..], |variable| &variable.data)
    };
    let (size, count) = (pce.outputs().len(), group.chains * group.draws);
    let theta = values_of("theta");
    let width = theta.len() / count.max(1);
    let rows = theta.chunks(width.max(1)).zip(values_of("sd").chunks(size));
    rows.zip(values_of("correlation").chunks(size * size))
        .map(|((theta, sd), correlation)| {
            let entry = |a: usize, b: usize| sd[a] * sd[b] * correlation[a * size + b];
            let scatter = (0..size).map(|a| (0..size).map(|b| entry(a, b)).collect()).collect();
            Draw { theta: theta.to_vec(), scatter }
        })
        .collect()
}
