//! The paper's calibration: matrix parameters from the quantities of interest of specimens.

mod contrasts;
mod error;
mod given_others;
mod groups;
mod influence;
mod likelihood;
mod loo;
mod population;
#[cfg(test)]
mod six_specimens;
mod specimens;
#[cfg(test)]
mod tests;
mod units;

use ppl::prelude::*;
use ppl::{Chains, Map, Mode, Nuts, Posterior, SampleError};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{CoefficientPosterior, DynPce};

use crate::qoi::Quantity;
pub use error::CalibrationError;
pub use groups::{Groups, Pooling, TestGroup, Trend, calibrate_groups, calibration_over_groups};
pub use influence::WithoutSpecimen;
use likelihood::of_specimens;
pub use population::Population;
pub use specimens::Specimens;
pub use specimens::column_means;

ppl::model! {
    /// Matrix parameters of a bonded granular material from specimen QoIs: the paper's three, with all
    /// sizes known at compile time.
    ///
    /// θ = (E, Gc, ξ) uniform on the prior box; every specimen's QoIs are normal around
    /// `forward(θ)` with one covariance diag(sd) R diag(sd): R ~ LKJ(3), sd ~ Normal(0.15, 0.25)
    /// above zero. QoIs are relative to their experimental means, so 0.15 is 15 % scatter.
    ///
    /// # Reference
    /// Paper, section "Quantities of Interest", equations of the likelihood.
    pub fn calibration<F: Differentiable<3, 3>>(
        forward: &F,
        qois: &[[f64; 3]],
        prior: &[[f64; 2]; 3],
    ) {
        let young_mpa          ~ Uniform(prior[0][0], prior[0][1]);
        let toughness_n_per_mm ~ Uniform(prior[1][0], prior[1][1]);
        let viscosity_mpa_s    ~ Uniform(prior[2][0], prior[2][1]);

        let sd   ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);

        #[track] let mean = forward.at([young_mpa, toughness_n_per_mm, viscosity_mpa_s]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
    }

    /// The same for as many parameters as the surrogate has inputs, uniform on its box, and as many
    /// QoIs as it has outputs; specimens may share an error of the forward model, and the last inputs
    /// may be known of each, or of some while those of the others come from their population.
    ///
    /// # Reference
    /// Kennedy & O'Hagan (2001), *Bayesian Calibration of Computer Models*,
    /// doi:10.1111/1467-9868.00294, for an error of the model beside that of the data.
    pub fn calibration_on(forward: &DynPce, specimens: &Specimens) {
        let mut point: Vec<Real> = Vec::new();
        #[dims(parameter)]
        for input in &forward.inputs()[..forward.inputs().len() - specimens.known_inputs()] {
            let theta ~ Uniform(input.lower, input.upper);
            point.push(theta);
        }

        let k = forward.outputs().len();
        #[dims(quantity)] let sd ~ Normal(0.15, 0.25).truncate(0.0..).iid(k);
        let corr ~ LkjCholesky::of(k, 3.0);
        let chol = corr.scale_rows(&sd)?;
        // what a person reads: the factor's own entries mean little
        #[dims(quantity, other)] #[track] let correlation = corr.covariance();

        let expected = specimens.expected(forward, &point)?;
        #[dims(qoi)] #[track] let mean = specimens.mean(&expected);
        let data ~ of_specimens(specimens, &expected, &chol);
        #[dims(qoi)] #[predict] let new_specimen ~ specimens.new_specimen(&expected, &chol)?;
    }
}

/// Posterior and mode of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Draws, predictions, prior, log-likelihoods. The parameters are `theta`, labelled by the names of
    /// the surrogate's inputs; quantities are relative to the means of the specimens.
    pub posterior: Posterior,
    /// Joint mode over the constrained values (no Jacobian), in the order of the surrogate's inputs.
    pub map: Vec<f64>,
    /// How the mode was found.
    pub mode: Mode,
    /// What it was calibrated to, relative to the means.
    specimens: Specimens,
    /// By this surrogate, relative likewise.
    forward: DynPce,
}

/// What experiments say of the specimens.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Quantities of interest, one row a specimen, in the order of the surrogate's outputs.
    pub qois: Vec<Vec<f64>>,
    /// The surrogate's last inputs of each specimen, where they are known: the stiffness ratio of its own
    /// microstructure. Empty: all inputs are to be found.
    pub known: Vec<Option<Vec<f64>>>,
    /// What those inputs may be of a specimen of which they are not known.
    pub population: Option<Population>,
    /// Covariance of the error that all specimens share, relative to their means: that of the mesh, the
    /// geometry, the surrogate where it is the same everywhere. Empty: none, the paper's likelihood.
    pub shared: Vec<Vec<f64>>,
    /// What the runs leave open of the surrogate, which is shared too, and what their specimens do where these are
    /// few: what a polynomial misses of one specimen belongs to `shared`.
    pub open: Vec<CoefficientPosterior>,
}

impl Evidence {
    /// How many of the surrogate's inputs, the last ones, are no parameters.
    pub fn known_inputs(&self) -> usize {
        let of_population = self.population.as_ref().map_or(0, |p| p.mean().len());
        self.known.iter().flatten().next().map_or(of_population, Vec::len)
    }

    /// These inputs of a specimen in the middle: the mean of those that are known, or of the population where
    /// some are not.
    pub fn middle(&self) -> Vec<f64> {
        let known: Vec<Vec<f64>> = self.known.iter().flatten().cloned().collect();
        match &self.population {
            Some(population) if known.len() < self.known.len() => population.mean().to_vec(),
            _ => column_means(&known),
        }
    }
}

/// Calibrates the inputs of a surrogate against specimens. The surrogate's box is the prior's. The sampler
/// brings chains, draws and seed; starts of the search for the mode are seeded with `seed`.
///
/// # Errors
/// Fewer than two specimens, rows or a covariance of another size, or a surrogate that rejects every start.
///
/// # Example
/// ```no_run
/// use breccia_calibration::{CalibrationError, Evidence, calibrate};
/// use ppl::Nuts;
/// use surrogate::DynPce;
///
/// fn first(pce: &DynPce, qois: Vec<Vec<f64>>) -> Result<f64, CalibrationError> {
///     let evidence = Evidence { qois, ..Evidence::default() };
///     let result = calibrate(pce, &evidence, &Nuts::default().seed(7), 7)?;
///     println!("{}", result.posterior.summary());
///     Ok(result.map[0])
/// }
/// ```
pub fn calibrate(
    pce: &DynPce,
    evidence: &Evidence,
    sampler: &Nuts<'_>,
    seed: u64,
) -> Result<Calibration, CalibrationError> {
    calibrate_after(pce, evidence, sampler, 0, seed)
}

/// The same without the first `burn_in` draws of each chain, which the sampler is to draw besides.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_after(
    pce: &DynPce,
    evidence: &Evidence,
    sampler: &Nuts<'_>,
    burn_in: usize,
    seed: u64,
) -> Result<Calibration, CalibrationError> {
    if evidence.qois.len() < 2 {
        return Err(CalibrationError::TooFew(evidence.qois.len()));
    }
    let (forward, specimens) = relative_to_means(pce, evidence)?;
    let model = calibration_on(&forward, &specimens);
    let mut chains = sampler.run(&model).map_err(SampleError::from)?;
    leave_out(&mut chains, burn_in);
    let mut posterior = Posterior::from_chains(&model, chains, seed)?;
    let unknown = &pce.inputs()[..pce.inputs().len() - specimens.known_inputs()];
    let names: Vec<&str> = unknown.iter().map(|input| input.name.as_str()).collect();
    posterior.label("theta", 0, &names)?;
    let short: Vec<String> = pce.outputs().iter().map(|name| short_name(name)).collect();
    let short: Vec<&str> = short.iter().map(String::as_str).collect();
    posterior.label("corr", 0, &short)?;
    posterior.label("corr", 1, &short)?;
    posterior.label("correlation", 0, &short)?;
    posterior.label("correlation", 1, &short)?;
    posterior.label("mean", 0, &short)?;
    let mode = Map::default().seed(seed).find(&model)?;
    let record = model.constrain(&mode.point, &mut Xoshiro256PlusPlus::seed_from_u64(seed))?;
    let map = record.values("theta").map_or_else(Vec::new, <[f64]>::to_vec);
    drop(model);
    Ok(Calibration { posterior, map, mode, specimens, forward })
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

/// The draws alone of [`calibrate`], unlabelled.
pub fn sample(
    pce: &DynPce,
    evidence: &Evidence,
    sampler: &Nuts<'_>,
    seed: u64,
) -> Result<Posterior, CalibrationError> {
    if evidence.qois.len() < 2 {
        return Err(CalibrationError::TooFew(evidence.qois.len()));
    }
    let (forward, specimens) = relative_to_means(pce, evidence)?;
    let model = calibration_on(&forward, &specimens);
    let chains = sampler.run(&model).map_err(SampleError::from)?;
    Ok(Posterior::from_chains(&model, chains, seed)?)
}

/// Surrogate and specimens with the specimens' means as units.
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

/// The name of a surrogate's output in tables, where it is relative and has no unit.
pub fn short_name(output: &str) -> String {
    Quantity::of_column(output).map_or_else(|| output.to_owned(), |quantity| quantity.to_string())
}

/// A covariance (quantities × quantities) relative to the quantities' means.
pub fn relative_covariance(covariance: Vec<Vec<f64>>, means: &[f64]) -> Vec<Vec<f64>> {
    let row =
        |(row, a): (Vec<f64>, &f64)| row.iter().zip(means).map(|(c, b)| c / (a * b)).collect();
    covariance.into_iter().zip(means).map(row).collect()
}
