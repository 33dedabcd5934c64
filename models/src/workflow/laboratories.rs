//! Laboratories with real simulations of specimens, and forward models to calibrate them by.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use fem::{RunInput, RunRecord};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, Input};

use super::WorkflowError;
use super::inputs::Inputs;
use super::level_runs::Runner;
use super::levels::Level;
use super::microstructures::Microstructures;
use super::simulator::{quantities, recorded};
use super::specimen_stiffness::with_stiffness_ratio;
use super::stage::Stage;
use super::stiffness::STIFFNESS_RATIO;
use super::task::Task;
use crate::case::{ByParameter, CaseFile};
use crate::coverage::Laboratory;
use crate::fracture::column_means;
use crate::qoi::Qois;
use crate::virtual_specimen::VirtualSpecimen;

/// What [`simulate_laboratories`] makes, all on the cheapest mesh of the case: specimens and ensembles of
/// one model, so that an error of the mesh is in both and in neither's way.
#[derive(Clone, Debug)]
pub struct SimulatedLaboratories {
    /// Experiments, each of as many specimens as the case has, on packings of their own.
    pub laboratories: Vec<Laboratory>,
    /// The case's design with a packing for each run.
    pub per_run: Dataset,
    /// The same on the case's own packing: the paper's way.
    pub one_packing: Dataset,
    /// The runs of `per_run` with the stiffness ratio of each packing as their last input.
    pub with_stiffness: Dataset,
    /// Means over packings at many more points, for a forward model next to the exact one.
    pub mean_response: Dataset,
}

/// Simulates so many laboratories whose truths are drawn from the inner part (a fraction of each side) of
/// the prior box, and the ensembles to calibrate them by: `points` of the mean response take two runs
/// each. Runs are kept in `dir/coverage`, so that a study
/// goes on where it stopped.
///
/// # Errors
/// A case without virtual specimens or without a packing; a simulation of a specimen that fails.
pub fn simulate_laboratories(
    file: &CaseFile,
    dir: &Path,
    [laboratories, points]: [usize; 2],
    inner: f64,
    threads: usize,
    interrupt: &AtomicBool,
) -> Result<SimulatedLaboratories, WorkflowError> {
    let inputs = Inputs::new(file, dir, Stage::that_writes);
    let task = Task::new("coverage", inputs, dir, threads, interrupt);
    let study = Study { task: &task, prior: task.inputs.prior()? };
    let design = task.inputs.design();
    let of_design = design.method.sample(&study.prior, design.runs, design.seed)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(design.seed);
    let seeds = |rng: &mut Xoshiro256PlusPlus, n: usize| -> Vec<u64> {
        (0..n).map(|_| u64::from(rng.random::<u32>())).collect()
    };
    // as the stage `ensemble` draws them, so that its runs serve here too
    let per_run = study.ensemble(&of_design, seeds(&mut rng, design.runs))?;
    let own = study.packings(Vec::new())?.own_seed();
    let one_packing = study.ensemble(&of_design, vec![own.unwrap_or_default(); design.runs])?;
    let at = DesignMethod::Sobol.sample(&study.prior, points, design.seed ^ 1)?;
    let mean_response = study.mean_response(&at, seeds(&mut rng, points))?;
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

    /// Runs on packings of these seeds, by the cheapest level of the case, and their stiffness ratios.
    fn records(
        &self,
        points: &[Vec<f64>],
        seeds: Vec<u64>,
    ) -> Result<(Vec<RunRecord>, Vec<f64>), WorkflowError> {
        let names: Vec<String> = self.prior.iter().map(|input| input.name.clone()).collect();
        // nothing of the case names these runs but what they are made of
        let kept = format!("{seeds:?}\n{points:?}\n");
        let packings = self.packings(seeds)?;
        let mut levels = Level::all(&self.task.inputs, 0)?;
        let mut level = levels.swap_remove(0);
        level.manifest += &kept;
        let runner = Runner { task: self.task, names: &names, specimens: Some(&packings) };
        let run = |(i, inputs): (usize, &Vec<f64>)| RunInput { id: i + 1, inputs: inputs.clone() };
        let records =
            runner.run(&level, &points.iter().enumerate().map(run).collect::<Vec<_>>(), true)?;
        let places = (0..points.len()).collect();
        let ratios = packings.stiffness_ratios(&self.task.inputs, &level, &places)?;
        Ok((records, ratios.into_values().collect()))
    }

    fn ensemble(&self, points: &[Vec<f64>], seeds: Vec<u64>) -> Result<Dataset, WorkflowError> {
        let qoi = self.task.inputs.qoi();
        let outputs = qoi.quantities.iter().map(|q| q.column().into_owned()).collect();
        let mut data = Dataset::new(self.prior.clone(), outputs, "coverage")?
            .with_notes(&[STIFFNESS_RATIO])?;
        let (records, ratios) = self.records(points, seeds)?;
        for (record, ratio) in records.iter().zip(ratios) {
            if let Ok(values) = quantities(record, qoi) {
                data.push_noted(&record.inputs, &values, &[&ratio.to_string()])?;
            }
        }
        Ok(data)
    }

    /// The mean over packings at each point: a packing is simulated at its point and in the middle of the
    /// box, and the ratio is multiplied by the mean of all packings in the middle.
    ///
    /// What a packing does to a quantity hardly depends on the parameters, so that it cancels in the ratio:
    /// the mean is known as that of all packings is, and not as a fit of so many terms to as many packings.
    fn mean_response(
        &self,
        points: &[Vec<f64>],
        seeds: Vec<u64>,
    ) -> Result<Dataset, WorkflowError> {
        let qoi = self.task.inputs.qoi();
        let middle: Vec<f64> = self.prior.iter().map(|i| 0.5 * (i.lower + i.upper)).collect();
        let (at_point, _) = self.records(points, seeds.clone())?;
        let (in_middle, _) = self.records(&vec![middle; points.len()], seeds)?;
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
        let (specimens, seed, qoi) = (*inputs.specimens()?, *inputs.seed()?, inputs.qoi());
        let own = self.packings(Vec::new())?.own_seed();
        let parameters = inputs.parameters()?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut truths: Vec<Vec<f64>> = Vec::new();
        let mut drawn: Vec<VirtualSpecimen> = Vec::new();
        for _ in 0..count {
            let place = |rng: &mut Xoshiro256PlusPlus| 0.5 + inner * (rng.random::<f64>() - 0.5);
            let of = |input: &Input| input.lower + place(&mut rng) * (input.upper - input.lower);
            let truth: Vec<f64> = self.prior.iter().map(of).collect();
            let by_name: ByParameter<f64> =
                parameters.iter().cloned().zip(truth.iter().copied()).collect();
            let scatter = inputs.scatter()?;
            drawn.extend(VirtualSpecimen::draw(specimens, rng.random(), &by_name, scatter, own));
            truths.push(truth);
        }
        let points: Vec<Vec<f64>> = drawn.iter().map(|v| v.parameters.clone()).collect();
        let seeds = drawn.iter().map(|v| v.packing_seed).collect();
        let (records, ratios) = self.records(&points, seeds)?;
        let measured = drawn.iter().zip(&records).map(|(specimen, record)| {
            let curve = specimen.measure(&recorded(&record.curve), inputs.noise()?);
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
