//! Virtual laboratories: simulated specimens, and the ensembles of simulations for their calibration.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use fem::{RunInput, RunRecord};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, Input};

use super::specimen_stiffness::with_stiffness_ratio;
use crate::case::{ByParameter, CaseFile, Parameter};
use crate::coverage::Laboratory;
use crate::experiments::preparation::Preparation;
use crate::experiments::{experiment_inputs, virtual_inputs};
use crate::fracture::column_means;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::stage::Stage;
use crate::pipeline::task::Task;
use crate::prior::Prior;
use crate::qoi::Qois;
use crate::results_folder::error::WorkflowError;
use crate::runs::level_runs::Runner;
use crate::runs::microstructures::Microstructures;
use crate::runs::run_source::key_of_runs;
use crate::runs::run_sources::source_of;
use crate::simulation::recorded::recorded_run;
use crate::simulation::run_values::quantities;
use crate::simulation::stiffness::STIFFNESS_RATIO;
use crate::specimen::levels::Level;
use crate::virtual_specimen::VirtualSpecimen;

/// Result of [`simulate_laboratories`]. Specimens and ensembles are simulated on the same mesh (the cheapest mesh
/// of the case), so that the error of the mesh cancels.
#[derive(Clone, Debug)]
pub struct SimulatedLaboratories {
    /// Laboratories, each with the number of specimens of the case. Each specimen has a separate
    /// packing.
    pub laboratories: Vec<Laboratory>,
    /// Runs of the design of the case, each with a separate packing.
    pub per_run: Dataset,
    /// Runs of the design of the case, all with the packing of the case, as in the paper.
    pub one_packing: Dataset,
    /// The runs of `per_run` with the stiffness ratio of each packing as their last input.
    pub with_stiffness: Dataset,
    /// Means over packings at `points` additional points, for a nearly exact forward model.
    pub mean_response: Dataset,
}

/// Simulates `laboratories` laboratories and the ensembles for their calibration. The true parameters are drawn from
/// the inner part of the prior box (`inner` is a fraction of each side). The mean response is computed at `points`
/// points with two runs each. Runs are stored in `dir/coverage`, so that an interrupted study is resumed.
///
/// # Errors
/// Fails if a prior of the case is not uniform, if the case has no virtual specimens or no packing, or if the
/// simulation of a specimen fails.
pub fn simulate_laboratories(
    file: &CaseFile,
    dir: &Path,
    [laboratories, point_count]: [usize; 2],
    inner: f64,
    threads: usize,
    interrupt: &AtomicBool,
) -> Result<SimulatedLaboratories, WorkflowError> {
    let inputs = Inputs::new(file, dir, Stage::that_writes);
    let task = Task::new("coverage", inputs, dir, threads, interrupt);
    let not_uniform = |(_, prior): &(&Parameter, &Prior)| !prior.is_uniform();
    if let Some((parameter, prior)) = task.inputs.first_prior()?.iter().find(not_uniform) {
        let problem = "has not the distribution of the true parameters, which are uniform";
        let help = "Write a range [lower, upper]: coverage is counted for uniform priors.";
        let key = format!("prior.{parameter}");
        return Err(file.error(&key, prior.to_string(), problem, help).into());
    }
    let study = Study { task: &task, prior: task.inputs.prior()? };
    let design = task.inputs.design();
    let of_design = design.method.sample(&study.prior, design.runs, design.seed)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(design.seed);
    let seeds = |rng: &mut Xoshiro256PlusPlus, n: usize| -> Vec<u64> {
        (0..n).map(|_| u64::from(rng.random::<u32>())).collect()
    };
    // use the same seeds as the stage `ensemble`, so that its runs are reused
    let per_run = study.ensemble(&of_design, seeds(&mut rng, design.runs))?;
    let case_seed = study.packings(Vec::new())?.case_seed();
    let one_packing =
        study.ensemble(&of_design, vec![case_seed.unwrap_or_default(); design.runs])?;
    let at = DesignMethod::Sobol.sample(&study.prior, point_count, design.seed ^ 1)?;
    let mean_response = study.mean_response(&at, seeds(&mut rng, point_count))?;
    let laboratories = study.laboratories(laboratories, inner)?;
    let seen: Vec<f64> =
        laboratories.iter().flat_map(|l| l.stiffness_ratios.iter().copied()).collect();
    let with_stiffness =
        with_stiffness_ratio(&per_run, &seen, None)?.unwrap_or_else(|| per_run.clone());
    Ok(SimulatedLaboratories { laboratories, per_run, with_stiffness, one_packing, mean_response })
}

struct Study<'a> {
    task: &'a Task<'a>,
    prior: Vec<Input>,
}

impl Study<'_> {
    fn packings(&self, seeds: Vec<u64>) -> Result<Microstructures, WorkflowError> {
        Microstructures::with_seeds(&self.task.inputs, seeds)?.ok_or_else(|| {
            let message = "a study of coverage needs specimens that are described by a packing";
            WorkflowError::Unusable(message.to_owned())
        })
    }

    /// Computes runs on packings with the given seeds, on the cheapest mesh of the case. Returns the records of the
    /// runs and the stiffness ratios of the packings.
    fn records(
        &self,
        parameter_points: &[Vec<f64>],
        seeds: Vec<u64>,
    ) -> Result<(Vec<RunRecord>, Vec<f64>), WorkflowError> {
        let names: Vec<String> = self.prior.iter().map(|input| input.name.clone()).collect();
        // the keys of the case do not identify the runs of a laboratory: the seeds and points of the runs do
        let points_and_seeds = format!("{seeds:?}\n{parameter_points:?}\n");
        let packings = self.packings(seeds)?;
        let source = source_of(&self.task.inputs)?;
        let key = key_of_runs(&self.task.inputs, &*source, Some(&packings))?;
        let level = Level::all(&self.task.inputs, &key.with(&points_and_seeds)).swap_remove(0);
        let specimens = Some(&packings);
        let runner = Runner { task: self.task, source: &*source, names: &names, specimens };
        let run = |(i, inputs): (usize, &Vec<f64>)| RunInput { id: i + 1, inputs: inputs.clone() };
        let records = runner.run(
            &level,
            &parameter_points.iter().enumerate().map(run).collect::<Vec<_>>(),
            true,
        )?;
        let places = (0..parameter_points.len()).collect();
        let ratios = packings.stiffness_ratios(&self.task.inputs, &level, &places)?;
        Ok((records, ratios.into_values().collect()))
    }

    fn ensemble(
        &self,
        parameter_points: &[Vec<f64>],
        seeds: Vec<u64>,
    ) -> Result<Dataset, WorkflowError> {
        let qoi = self.task.inputs.qoi();
        let outputs = qoi.quantities.iter().map(|q| q.column().into_owned()).collect();
        let mut data = Dataset::new(self.prior.clone(), outputs, "coverage")?
            .with_notes(&[STIFFNESS_RATIO])?;
        let (records, ratios) = self.records(parameter_points, seeds)?;
        for (record, ratio) in records.iter().zip(ratios) {
            if let Ok(values) = quantities(record, qoi) {
                data.push_noted(&record.inputs, &values, &[&ratio.to_string()])?;
            }
        }
        Ok(data)
    }

    /// Estimates the mean response over packings at each point. Each point has a separate packing, which is simulated
    /// at the point and at the centre of the prior box. The ratio of the two results is multiplied by the mean over
    /// all packings at the centre.
    ///
    /// The effect of a packing on a quantity hardly depends on the parameters, so that it cancels in the ratio. The
    /// error is therefore the error of a mean over all packings, which is smaller than the error of a fit with many
    /// terms to the same number of packings.
    fn mean_response(
        &self,
        parameter_points: &[Vec<f64>],
        seeds: Vec<u64>,
    ) -> Result<Dataset, WorkflowError> {
        let qoi = self.task.inputs.qoi();
        let middle: Vec<f64> = self.prior.iter().map(|i| 0.5 * (i.lower + i.upper)).collect();
        let (at_point, _) = self.records(parameter_points, seeds.clone())?;
        let (in_middle, _) = self.records(&vec![middle; parameter_points.len()], seeds)?;
        let both = at_point.iter().zip(&in_middle).filter_map(|(point, middle)| {
            Some((&point.inputs, quantities(point, qoi).ok()?, quantities(middle, qoi).ok()?))
        });
        let both: Vec<_> = both.collect();
        let middles: Vec<Vec<f64>> = both.iter().map(|(_, _, middle)| middle.clone()).collect();
        let mean = column_means(&middles);
        let outputs = qoi.quantities.iter().map(|q| q.column().into_owned()).collect();
        let mut data = Dataset::new(self.prior.clone(), outputs, "coverage")?;
        for (inputs, point, middle) in both {
            let values: Vec<f64> =
                (0..mean.len()).map(|m| mean[m] * point[m] / middle[m]).collect();
            data.push(inputs, &values)?;
        }
        Ok(data)
    }

    fn laboratories(&self, count: usize, inner: f64) -> Result<Vec<Laboratory>, WorkflowError> {
        let inputs = &self.task.inputs;
        let (specimens, seed, qoi) =
            (*virtual_inputs::specimens(inputs)?, *virtual_inputs::seed(inputs)?, inputs.qoi());
        let case_seed = self.packings(Vec::new())?.case_seed();
        let parameters = inputs.parameters()?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut truths: Vec<Vec<f64>> = Vec::new();
        let mut drawn: Vec<VirtualSpecimen> = Vec::new();
        for _ in 0..count {
            let position = |rng: &mut Xoshiro256PlusPlus| 0.5 + inner * (rng.random::<f64>() - 0.5);
            let parameter =
                |input: &Input| input.lower + position(&mut rng) * (input.upper - input.lower);
            let truth: Vec<f64> = self.prior.iter().map(parameter).collect();
            let by_name: ByParameter<f64> =
                parameters.iter().cloned().zip(truth.iter().copied()).collect();
            let scatter = virtual_inputs::scatter(inputs)?;
            drawn.extend(VirtualSpecimen::draw(
                specimens,
                rng.random(),
                &by_name,
                scatter,
                case_seed,
            ));
            truths.push(truth);
        }
        let parameter_points: Vec<Vec<f64>> = drawn.iter().map(|v| v.parameters.clone()).collect();
        let seeds = drawn.iter().map(|v| v.packing_seed).collect();
        let (records, ratios) = self.records(&parameter_points, seeds)?;
        let (machine, preparation) =
            (experiment_inputs::known_machine(inputs).machine(), Preparation::of(inputs));
        let measured = drawn.iter().zip(&records).map(|(specimen, record)| {
            let reading = specimen
                .measure(&machine.record(&recorded_run(record)), virtual_inputs::noise(inputs)?);
            let curve = match inputs.test().program.is_some() {
                true => preparation.apply(&reading, qoi.slope_fraction).0,
                false => machine.specimen(&reading),
            };
            Qois::values_of(&curve, qoi.slope_fraction, &qoi.quantities).map_err(|error| {
                let message = format!("a specimen of laboratory {}: {error}", record.id);
                WorkflowError::Unusable(message)
            })
        });
        let measured: Vec<Vec<f64>> = measured.collect::<Result<_, WorkflowError>>()?;
        let tests = measured.chunks(specimens).zip(ratios.chunks(specimens));
        let laboratory = |(truth, (specimens, ratios)): (_, (&[Vec<f64>], &[f64]))| Laboratory {
            truth,
            specimens: specimens.to_vec(),
            stiffness_ratios: ratios.to_vec(),
        };
        Ok(truths.into_iter().zip(tests).map(laboratory).collect())
    }
}
