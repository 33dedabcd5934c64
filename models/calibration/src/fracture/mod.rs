//! The paper's calibration: matrix parameters from the quantities of interest of specimens.
//!
//! 1. `error`, `contrasts`, `population`, `within_box`: errors, transforms of quantities and of parameters
//! 2. `specimens`: specimens prepared for the likelihood
//! 3. `given_others`, `likelihood`: densities of specimens
//! 4. `loo`, `influence`, `sensitivity`, `units`: cross-validation, influence of each specimen and of the priors, units of
//!    the results
//! 5. `groups`, `joint`: calibrations of several groups of specimens or of several tests

mod contrasts;
mod error;
mod given_others;
mod groups;
#[cfg(test)]
mod incomplete;
mod influence;
mod joint;
mod likelihood;
mod loo;
mod population;
mod sensitivity;
#[cfg(test)]
mod six_specimens;
mod specimens;
#[cfg(test)]
mod tests;
mod units;
mod within_box;

use ppl::prelude::*;
use ppl::{Chains, Map, Mode, Nuts, Posterior, SampleError};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{CoefficientPosterior, DynPce, Input};

use crate::prior::Prior;
use crate::qoi::Quantity;
pub use error::CalibrationError;
pub use groups::{Groups, Pooling, TestGroup, Trend, calibrate_groups, calibration_over_groups};
pub use influence::WithoutSpecimen;
pub use joint::{
    BetweenTests, JointCalibration, JointTest, JointTests, TestDraws, TrendOverTests,
    calibrate_tests, calibration_of_draws, calibration_over_tests,
};
use likelihood::of_specimens;
pub use population::Population;
pub use sensitivity::PriorSensitivity;
pub use specimens::Specimens;
pub use specimens::column_means;

ppl::model! {
    /// Model of the matrix parameters of a bonded granular material, given the quantities of
    /// interest (QoIs) of specimens.
    ///
    /// There is one parameter θ per prior; the parameters are the first inputs of the forward model. The QoIs of a
    /// specimen, relative to their means over the specimens, are normal around the forward model with one covariance
    /// diag(sd) R diag(sd): R ~ LKJ(3), sd ~ Normal(0.15, 0.25) above zero, so 0.15 is 15 % scatter. Specimens may share
    /// an error of the forward model. The other inputs of the forward model are known for each specimen. If some
    /// specimens have unknown inputs, these belong to a population.
    ///
    /// # References
    /// Paper, section "Quantities of Interest", equations of the likelihood; Kennedy & O'Hagan (2001), *Bayesian Calibration of Computer Models*, doi:10.1111/1467-9868.00294, for an error
    /// of the model in addition to the error of the data.
    pub fn calibration_on<F: DynDifferentiable>(
        forward: &F,
        priors: &[Prior],
        specimens: &Specimens,
    ) {
        let mut point: Vec<Real> = Vec::new();
        #[dims(parameter)]
        for prior in priors {
            let theta ~ *prior;
            point.push(theta);
        }

        let k = forward.outputs();
        #[dims(quantity)] let sd ~ Normal(0.15, 0.25).truncate(0.0..).iid(k);
        let corr ~ LkjCholesky::of(k, 3.0);
        let chol = corr.scale_rows(&sd)?;
        // `#[track]` records the correlation matrix, because the entries of the Cholesky factor are hard to interpret
        #[dims(quantity, other)] #[track] let correlation = corr.covariance();

        let expected = specimens.expected(forward, &point)?;
        #[dims(qoi)] #[track] let mean = specimens.mean(&expected);
        let data ~ of_specimens(specimens, &expected, &chol);
        #[dims(qoi)] #[predict] let new_specimen ~ given_others::new_specimen(specimens, &expected, &chol)?;
    }
}

/// Posterior and mode of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Draws, predictions, prior, log-likelihoods. The parameters are `theta`, labelled by the names of
    /// the surrogate's inputs; quantities are relative to the means of the specimens.
    pub posterior: Posterior,
    /// Joint mode of the density of the parameters (without the Jacobian of the transform), in the order of the
    /// surrogate's inputs.
    pub map: Vec<f64>,
    /// Result of the search for the mode; `None` if the draws come from a joint calibration of several tests.
    pub mode: Option<Mode>,
    /// Specimens of the calibration, with quantities relative to the means of the specimens.
    specimens: Specimens,
    /// Surrogate of the calibration, with outputs relative to the means of the specimens.
    forward: DynPce,
    /// Priors of the parameters.
    priors: Vec<Prior>,
}

/// Experimental data of the specimens, and the errors of the forward model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Quantities of interest, one row per specimen, in the order of the surrogate's outputs. NaN: the quantity was not
    /// recorded for this specimen.
    pub qois: Vec<Vec<f64>>,
    /// For each specimen, the last inputs of the surrogate, such as the stiffness ratio of the microstructure; `None`
    /// if these inputs are unknown. An empty list means that all inputs are parameters.
    pub known: Vec<Option<Vec<f64>>>,
    /// Population of the last inputs of the surrogate, for specimens whose inputs are unknown.
    pub population: Option<Population>,
    /// Covariance of the error that all specimens share, relative to the means of the quantities. This error includes
    /// errors of the mesh, of the geometry, and of the surrogate if the surrogate's error is the same everywhere.
    /// Empty: no shared error, as in the paper's likelihood.
    pub shared: Vec<Vec<f64>>,
    /// Errors of the forward model that depend on the parameters and that all specimens share. These errors arise from
    /// the limited number of runs and from the limited number of specimens in these runs. The lack of fit of a
    /// polynomial to a single specimen belongs to `shared`.
    pub open: Vec<CoefficientPosterior>,
}

impl Evidence {
    /// Number of inputs at the end of the surrogate's inputs that are not parameters.
    pub fn known_inputs(&self) -> usize {
        let of_population = self.population.as_ref().map_or(0, |p| p.mean().len());
        self.known.iter().flatten().next().map_or(of_population, Vec::len)
    }

    /// Indices of the recorded quantities of each specimen.
    pub fn recorded(&self) -> Vec<Vec<usize>> {
        self.qois.iter().map(|row| contrasts::recorded(row)).collect()
    }

    /// Number of specimens with a quantity.
    pub fn specimens_with(&self, quantity: usize) -> usize {
        self.qois.iter().filter(|row| !row[quantity].is_nan()).count()
    }

    /// Typical values of the inputs that are not parameters: the mean of the population if some specimens have unknown
    /// inputs, or else the mean over the specimens.
    pub fn middle(&self) -> Vec<f64> {
        let known: Vec<Vec<f64>> = self.known.iter().flatten().cloned().collect();
        match &self.population {
            Some(population) if known.len() < self.known.len() => population.mean().to_vec(),
            _ => column_means(&known),
        }
    }
}

/// Calibrates the inputs of a surrogate against specimens. `priors` are the priors of the inputs that are
/// parameters; inputs that are known for each specimen have no prior. `sampler` determines chains, draws and their
/// seed. `seed` is the seed of the predictions and of the starting points for the search for the mode.
///
/// # Errors
/// If there are fewer than two specimens, a row or a covariance has the wrong size, the ranges of the priors are not
/// the box of the surrogate, or the surrogate rejects every starting point.
///
/// # Example
/// ```no_run
/// use breccia_calibration::{CalibrationError, Evidence, Prior, calibrate};
/// use ppl::Nuts;
/// use surrogate::DynPce;
///
/// fn first(pce: &DynPce, qois: Vec<Vec<f64>>) -> Result<f64, CalibrationError> {
///     let evidence = Evidence { qois, ..Evidence::default() };
///     let priors = Prior::uniform_on(pce.inputs());
///     let result = calibrate(pce, &priors, &evidence, &Nuts::default().seed(7), 7)?;
///     println!("{}", result.posterior.summary());
///     Ok(result.map[0])
/// }
/// ```
pub fn calibrate(
    pce: &DynPce,
    priors: &[Prior],
    evidence: &Evidence,
    sampler: &Nuts<'_>,
    seed: u64,
) -> Result<Calibration, CalibrationError> {
    calibrate_after(pce, priors, evidence, sampler, 0, seed)
}

/// Calibrates like [`calibrate`], but omits the first `burn_in` draws of each chain, which `sampler` must draw
/// in addition.
///
/// # Errors
/// The errors of [`calibrate`].
pub fn calibrate_after(
    pce: &DynPce,
    priors: &[Prior],
    evidence: &Evidence,
    sampler: &Nuts<'_>,
    burn_in: usize,
    seed: u64,
) -> Result<Calibration, CalibrationError> {
    if evidence.qois.len() < 2 {
        return Err(CalibrationError::TooFew(evidence.qois.len()));
    }
    let (forward, specimens) = relative_to_means(pce, evidence)?;
    let unknown = unknown_inputs(pce, priors, specimens.known_inputs())?;
    let model = calibration_on(&forward, priors, &specimens);
    let mut chains = sampler.run(&model).map_err(SampleError::from)?;
    leave_out(&mut chains, burn_in);
    let mut posterior = Posterior::from_chains(&model, chains, seed)?;
    label(&mut posterior, pce, unknown.len())?;
    let mode = Map::default().seed(seed).find(&model)?;
    let record = model.constrain(&mode.point, &mut Xoshiro256PlusPlus::seed_from_u64(seed))?;
    let map = record.values("theta").map_or_else(Vec::new, <[f64]>::to_vec);
    drop(model);
    let mode = Some(mode);
    Ok(Calibration { posterior, map, mode, specimens, forward, priors: priors.to_vec() })
}

/// Labels the parameters by the names of the surrogate's first inputs, and the quantities by their short names.
fn label(
    posterior: &mut Posterior,
    pce: &DynPce,
    parameters: usize,
) -> Result<(), ppl::LabelError> {
    let names: Vec<&str> = pce.inputs()[..parameters].iter().map(|i| i.name.as_str()).collect();
    posterior.label("theta", 0, &names)?;
    let short: Vec<String> = pce.outputs().iter().map(|name| short_name(name)).collect();
    let short: Vec<&str> = short.iter().map(String::as_str).collect();
    posterior.label("corr", 0, &short)?;
    posterior.label("corr", 1, &short)?;
    posterior.label("correlation", 0, &short)?;
    posterior.label("correlation", 1, &short)?;
    posterior.label("mean", 0, &short)
}

/// Returns the inputs of a surrogate that are parameters.
///
/// # Errors
/// If the ranges of the priors are not the box of these inputs.
fn unknown_inputs<'a>(
    pce: &'a DynPce,
    priors: &[Prior],
    known: usize,
) -> Result<&'a [Input], CalibrationError> {
    let unknown = &pce.inputs()[..pce.inputs().len().saturating_sub(known)];
    let boxes = unknown.iter().map(|input| [input.lower, input.upper]);
    match boxes.eq(priors.iter().map(Prior::range)) {
        true => Ok(unknown),
        false => Err(CalibrationError::Priors),
    }
}

/// Removes the first draws of each chain.
fn leave_out(chains: &mut Chains, first: usize) {
    let dim = chains.dim;
    for chain in &mut chains.chains {
        let first = first.min(chain.len());
        chain.draws.drain(..first * dim);
        chain.stats.drain(..first);
        chain.divergences.retain_mut(|divergence| {
            let is_kept = divergence.draw >= first;
            divergence.draw = divergence.draw.saturating_sub(first);
            is_kept
        });
    }
}

/// Calibrates like [`calibrate`], but returns only the posterior, without labels.
pub fn sample(
    pce: &DynPce,
    priors: &[Prior],
    evidence: &Evidence,
    sampler: &Nuts<'_>,
    seed: u64,
) -> Result<Posterior, CalibrationError> {
    if evidence.qois.len() < 2 {
        return Err(CalibrationError::TooFew(evidence.qois.len()));
    }
    let (forward, specimens) = relative_to_means(pce, evidence)?;
    unknown_inputs(pce, priors, specimens.known_inputs())?;
    let model = calibration_on(&forward, priors, &specimens);
    let chains = sampler.run(&model).map_err(SampleError::from)?;
    Ok(Posterior::from_chains(&model, chains, seed)?)
}

/// Divides the outputs of the surrogate and the quantities of the specimens by the means of the specimens.
fn relative_to_means(
    pce: &DynPce,
    evidence: &Evidence,
) -> Result<(DynPce, Specimens), CalibrationError> {
    let Evidence { qois, known, population, shared, open } = evidence;
    let expected = pce.outputs().len();
    if let Some(row) = qois.iter().find(|row| row.len() != expected) {
        return Err(CalibrationError::Quantities { expected, found: row.len() });
    }
    let mean = column_means(qois);
    if let Some(m) = mean.iter().position(|mean| mean.is_nan()) {
        return Err(CalibrationError::NotRecorded { quantity: pce.outputs()[m].clone() });
    }
    let relative: Vec<Vec<f64>> =
        qois.iter().map(|row| row.iter().zip(&mean).map(|(y, mean)| y / mean).collect()).collect();
    let factors: Vec<f64> = mean.iter().map(|mean| mean.recip()).collect();
    let forward = pce.clone().scale_outputs(&factors)?;
    let mut specimens = Specimens::new(&relative)?;
    if !shared.is_empty() {
        specimens = specimens.sharing(shared.clone())?;
    }
    if !known.is_empty() {
        specimens = specimens.knowing(known, population.clone())?;
    }
    for open in open {
        let scatter = relative_covariance(open.scatter(&mean)?, &mean);
        specimens = specimens.leaving_open(open.clone(), scatter)?;
    }
    Ok((forward, specimens))
}

/// Name of a surrogate's output without a unit, for relative quantities.
pub fn short_name(output: &str) -> String {
    Quantity::of_column(output).map_or_else(|| output.to_owned(), |quantity| quantity.to_string())
}

/// Divides a covariance (quantities × quantities) by the quantities' means.
pub fn relative_covariance(covariance: Vec<Vec<f64>>, means: &[f64]) -> Vec<Vec<f64>> {
    let row =
        |(row, a): (Vec<f64>, &f64)| row.iter().zip(means).map(|(c, b)| c / (a * b)).collect();
    covariance.into_iter().zip(means).map(row).collect()
}
