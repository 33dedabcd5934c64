//! `predictive_curves.csv`: posterior prediction of the curve of a new specimen.

use std::collections::BTreeMap;

use fem::read_curve;
use ppl::Posterior;
use surrogate::{Dataset, DynPce, FitReport, GroupedRuns};

use super::fitted::{of_specimens_of_runs, options_on};
use super::specimen_stiffness::with_stiffness_ratio;
use crate::experiment::TestCurve;
use crate::experiments::experiment_inputs;
use crate::experiments::few_specimens::of_few;
use crate::experiments::mesh_scale::MeshScale;
use crate::experiments::preparation::Preparation;
use crate::fracture::{Evidence, column_means};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::predicted_curve::{
    PredictedCurves, PredictedSpecimen, QUANTILES, largest_percentage, percentages, shape,
};
use crate::qoi::{DisplacementAtPeak, PeakForce, Qoi, QoiError, Quantity, RelativeForce};
use crate::report::BandEnd;
use crate::results_folder::error::WorkflowError;
use crate::runs::fidelity::{Correction, added, error_of_all};
use crate::runs::level_runs::curve_of_level;
use crate::runs::made_on::{IMAGE, MadeOn, SEED};
use crate::simulation::recorded::recorded_with;
use crate::simulation::stiffness::STIFFNESS_RATIO;
use crate::table::CsvTable;

/// Maximum number of posterior draws; more draws do not make the quantiles visibly smoother.
const MOST_DRAWS: usize = 2000;

/// Writes the quantiles of the predicted curve. If the curve cannot be predicted, returns the reason.
///
/// # Errors
/// Fails if the folder cannot be written.
pub(crate) fn write_predicted_curves(
    task: &Task<'_>,
    pce: &DynPce,
    posterior: &Posterior,
    evidence: &Evidence,
) -> Result<Option<String>, WorkflowError> {
    let has_curves = task.inputs.is_built_in()
        || !task.inputs.imports_runs()
            && experiment_inputs::measured_values(&task.inputs).is_none();
    if !has_curves {
        return Ok(None);
    }
    let curves = match predicted(&task.inputs, pce, posterior, evidence) {
        Ok(curves) => curves,
        Err(reason) => {
            return Ok(Some(format!("Curves of new specimens are not predicted: {reason}.")));
        }
    };
    let names = QUANTILES.map(|p| format!("force_N_q{:02.0}", 100.0 * p));
    let header = ["displacement_mm"].into_iter().chain(names.iter().map(String::as_str));
    let rows =
        curves.displacement_mm.iter().zip(&curves.force_n).map(|(u, forces)| {
            [u].into_iter().chain(forces).map(f64::to_string).collect::<Vec<_>>()
        });
    task.write_csv("predictive_curves.csv", header, rows)?;
    Ok(None)
}

/// Reason for the end of the predicted band; `None` if the curves cannot be read.
pub(crate) fn band_end(inputs: &Inputs<'_>) -> Option<BandEnd> {
    let curves = Curves::read(inputs).ok()?;
    let (reach, name) = curves.shortest().ok()??;
    let percent = *percentages(reach).last()?;
    let is_limit = reach < f64::from(RelativeForce::LARGEST_PERCENT);
    Some(BandEnd { percent, shortest: is_limit.then(|| name.to_owned()) })
}

/// Reason why curves cannot be predicted.
#[derive(Debug, thiserror::Error)]
enum Reason {
    #[error("qoi.quantities lacks {0}, which gives them their size")]
    Quantity(Quantity),
    #[error("{0} is not there; make the runs again in a new folder")]
    NoCurve(String),
    #[error("the shape of {0}: {1}")]
    Shape(String, QoiError),
    #[error(transparent)]
    Surrogate(#[from] surrogate::SurrogateError),
    #[error(transparent)]
    Workflow(#[from] WorkflowError),
}

fn predicted(
    inputs: &Inputs<'_>,
    pce: &DynPce,
    posterior: &Posterior,
    evidence: &Evidence,
) -> Result<PredictedCurves, Reason> {
    let index_of = |quantity: Quantity| {
        let index = pce.outputs().iter().position(|output| *output == quantity.column());
        index.ok_or(Reason::Quantity(quantity))
    };
    let size = [index_of(Quantity::new(PeakForce))?, index_of(Quantity::new(DisplacementAtPeak))?];
    let curves = Curves::read(inputs)?;
    let percent = curves.percentages()?;
    let model = ShapeModel::of(inputs, pce, &curves, evidence, &percent)?;
    let known_inputs = evidence.middle();
    let draws: Vec<PredictedSpecimen> = draws(posterior, pce.outputs().len())
        .map(|(theta, predicted)| {
            let [peak_force_n, displacement_at_peak_mm] = size.map(|m| predicted[m]);
            let shape = model.pce.value(&[theta, &known_inputs[..]].concat())?;
            Ok(PredictedSpecimen { peak_force_n, displacement_at_peak_mm, shape })
        })
        .collect::<Result<_, Reason>>()?;
    let shapes: Vec<Vec<f64>> = draws.iter().map(|draw| draw.shape.clone()).collect();
    let error = model.error(&column_means(&shapes))?;
    let tested = curves.specimens.iter().map(|curve| curve.shape(&percent));
    let tested: Vec<Vec<f64>> = tested.collect::<Result<_, Reason>>()?;
    let seed = inputs.calibration().seed;
    Ok(PredictedCurves::of(&percent, &draws, &tested, &error, seed))
}

/// Parameters and predicted quantities of a new specimen for each draw.
fn draws(posterior: &Posterior, quantities: usize) -> impl Iterator<Item = (&[f64], &[f64])> {
    let theta = posterior.posterior.get("theta").map_or(&[][..], |values| &values.data);
    let new = posterior.predictive.get("new_specimen").map_or(&[][..], |values| &values.data);
    let count = new.len() / quantities;
    let all = theta.chunks((theta.len() / count.max(1)).max(1)).zip(new.chunks(quantities));
    let finite = all.filter(|(_, new)| new.iter().all(|y| y.is_finite()));
    finite.step_by(count.div_ceil(MOST_DRAWS).max(1))
}

/// A curve, and the name of its run or specimen for messages.
struct Named {
    name: String,
    curve: TestCurve,
}

impl Named {
    /// The curve of run `i` of `runs`, or of its repetition on another mesh.
    fn simulated(
        inputs: &Inputs<'_>,
        name: String,
        runs: &Dataset,
        i: usize,
    ) -> Result<Self, Reason> {
        let path = inputs.file_if_there(&name).ok_or_else(|| Reason::NoCurve(name.clone()))?;
        let names = runs.inputs().iter().map(|input| input.name.as_str());
        let of_run = names.zip(runs.row(i).0.iter().copied());
        let curve = recorded_with(of_run, &read_curve(path).map_err(WorkflowError::from)?);
        Ok(Self { name, curve })
    }

    fn shape(&self, percent: &[u8]) -> Result<Vec<f64>, Reason> {
        shape(&self.curve, percent).map_err(|error| Reason::Shape(self.name.clone(), error))
    }
}

/// All curves from which the shape is determined.
struct Curves {
    runs: Dataset,
    of_runs: Vec<Named>,
    /// For each more accurate level: the curves of the runs that were repeated on this level, by the number of the run.
    better: Vec<BTreeMap<String, Named>>,
    specimens: Vec<Named>,
}

impl Curves {
    fn read(inputs: &Inputs<'_>) -> Result<Self, Reason> {
        let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
        let run = |i: usize| runs.note(i, "run").unwrap_or_default();
        let of_runs = (0..runs.len())
            .map(|i| Named::simulated(inputs, format!("curves/run-{:0>3}.csv", run(i)), &runs, i))
            .collect::<Result<_, Reason>>()?;
        let mut better: Vec<BTreeMap<String, Named>> = Vec::new();
        if let Some(path) = inputs.file_if_there("fidelity_runs.csv") {
            let table = CsvTable::read(&path, &["level", "run"]).map_err(WorkflowError::from)?;
            for row in table.rows() {
                let (level, run) =
                    (row.number("level").map_err(WorkflowError::from)?, row.text("run"));
                let Some(level_index) = (level as usize).checked_sub(2) else { continue };
                let Some(i) = (0..runs.len()).find(|&i| runs.note(i, "run") == Some(run)) else {
                    continue;
                };
                better.resize_with(better.len().max(level_index + 1), BTreeMap::new);
                let curve =
                    Named::simulated(inputs, curve_of_level(level as usize, run), &runs, i)?;
                better[level_index].insert(run.to_owned(), curve);
            }
        }
        // a curve that ends before its peak has no shape relative to the peak
        let mut specimens = specimens(inputs)?;
        specimens.retain(|specimen| largest_percentage(&specimen.curve).is_ok());
        Ok(Self { runs, of_runs, better, specimens })
    }

    /// Percentages of the peak displacement at which the shape of curves is evaluated; all curves extend to the largest
    /// percentage.
    fn percentages(&self) -> Result<Vec<u8>, Reason> {
        Ok(percentages(self.shortest()?.map_or(f64::INFINITY, |(reach, _)| reach)))
    }

    /// Returns the curve that ends first relative to its displacement at peak: the end of the curve in %
    /// of its displacement at peak, and the name of the curve.
    fn shortest(&self) -> Result<Option<(f64, &str)>, Reason> {
        let better = self.better.iter().flat_map(BTreeMap::values);
        let mut shortest: Option<(f64, &str)> = None;
        for named in self.of_runs.iter().chain(better).chain(&self.specimens) {
            let reach = largest_percentage(&named.curve)
                .map_err(|error| Reason::Shape(named.name.clone(), error))?;
            if shortest.is_none_or(|(least, _)| reach < least) {
                shortest = Some((reach, &named.name));
            }
        }
        Ok(shortest)
    }
}

/// Reads the curves of the specimens, processed in the same way as for their quantities of interest.
fn specimens(inputs: &Inputs<'_>) -> Result<Vec<Named>, WorkflowError> {
    let table = experiment_inputs::chosen(inputs, experiment_inputs::specimen_table(inputs)?)?;
    let path = inputs.file("experiments.csv")?;
    let used = CsvTable::read(&path, &["id", MeshScale::COLUMNS[0], "slope_fraction"])?;
    let preparation = Preparation::of(inputs);
    let mut curves = Vec::new();
    for specimen in table.specimens {
        let row = used.named("id", &specimen.id)?;
        let fraction = row.number("slope_fraction")?;
        let (curve, _) = preparation.apply(&specimen.curve, fraction);
        let curve = MeshScale::of_row(row)?.apply(&curve);
        curves.push(Named { name: format!("curves/{}.csv", specimen.id), curve });
    }
    Ok(curves)
}

/// The curves of the specimens, processed in the same way as for their quantities of interest.
///
/// # Errors
/// Fails if a file of the specimens cannot be read.
pub(crate) fn specimen_curves(inputs: &Inputs<'_>) -> Result<Vec<TestCurve>, WorkflowError> {
    Ok(specimens(inputs)?.into_iter().map(|named| named.curve).collect())
}

/// Notes of a run that identify its specimen.
const NOTES: [&str; 3] = [SEED, IMAGE, STIFFNESS_RATIO];

/// Surrogate of the curve shape as a function of the parameters, on the mesh of the case.
struct ShapeModel {
    pce: DynPce,
    report: FitReport,
    corrections: Vec<FitReport>,
    made_on: MadeOn,
    specimens: Option<GroupedRuns>,
}

impl ShapeModel {
    fn of(
        inputs: &Inputs<'_>,
        pce: &DynPce,
        curves: &Curves,
        evidence: &Evidence,
        percent: &[u8],
    ) -> Result<Self, Reason> {
        let Curves { runs, of_runs, better, .. } = curves;
        let outputs: Vec<String> = percent
            .iter()
            .filter_map(|&percent| RelativeForce::new(percent))
            .map(|quantity| quantity.column().into_owned())
            .collect();
        let mut shapes =
            of_runs.iter().map(|run| run.shape(percent)).collect::<Result<Vec<_>, _>>()?;
        // shape of each run by the name of the run, before the correction by runs on more accurate meshes
        let run = |i: usize| runs.note(i, "run").unwrap_or_default();
        let mut before: BTreeMap<&str, Vec<f64>> =
            (0..runs.len()).map(run).zip(shapes.iter().cloned()).collect();
        let row_of: BTreeMap<&str, usize> = (0..runs.len()).map(|i| (run(i), i)).collect();
        let mut corrections = Vec::new();
        for level in better {
            let mut now = BTreeMap::new();
            for (run, curve) in level {
                now.insert(run.as_str(), curve.shape(percent)?);
            }
            let both: Vec<(&[f64], &[f64], &[f64])> = now
                .iter()
                .filter_map(|(run, better)| {
                    let inputs = runs.row(*row_of.get(run)?).0;
                    Some((inputs, before.get(run)?.as_slice(), better.as_slice()))
                })
                .collect();
            let correction = Correction::of(runs.inputs(), &outputs, &both)?;
            for (i, shape) in shapes.iter_mut().enumerate() {
                correction.apply(runs.row(i).0, shape, &mut [])?;
            }
            corrections.push(correction.report().clone());
            before = now;
        }
        let mut data = Dataset::new(runs.inputs().to_vec(), outputs, "breccia ensemble")?
            .with_notes(&NOTES)?;
        for (i, shape) in shapes.iter().enumerate() {
            let notes = NOTES.map(|name| runs.note(i, name).unwrap_or_default());
            data.push_noted(runs.row(i).0, shape, &notes)?;
        }
        let mut with_ratio = None;
        if pce.inputs().len() > runs.inputs().len() {
            let ratios: Vec<f64> = evidence.known.iter().flatten().flatten().copied().collect();
            with_ratio = with_stiffness_ratio(&data, &ratios, evidence.population.as_ref())?;
        }
        let made_on = MadeOn::of(runs);
        let options = options_on(inputs.surrogate(), &made_on, with_ratio.as_ref());
        let fitted_to = with_ratio.as_ref().unwrap_or(&data);
        let fit = DynPce::fit(fitted_to, &options)?;
        let specimens = of_specimens_of_runs(&fit, fitted_to, &made_on)?;
        Ok(Self { pce: fit.pce, report: fit.report, corrections, made_on, specimens })
    }

    /// Covariance of the error of the shape `at`, computed with the method for quantities of interest.
    fn error(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, Reason> {
        let mut error = match (&self.specimens, &self.made_on) {
            (Some(specimens), _) => {
                added(&specimens.within.mean_error(at)?, &of_few(specimens).mean_error(at)?)
            }
            (None, MadeOn::One) => self.report.lack_of_fit(at)?,
            (None, _) => self.report.mean_error(at)?,
        };
        if let Some(relative) = error_of_all(&self.corrections, &self.made_on)? {
            for ((row, relative), a) in error.iter_mut().zip(relative).zip(at) {
                row.iter_mut()
                    .zip(relative)
                    .zip(at)
                    .for_each(|((entry, c), b)| *entry += a * b * c);
            }
        }
        Ok(error)
    }
}
