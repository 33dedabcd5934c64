//! The paper's calibration: matrix parameters from the quantities of interest of specimens.

mod groups;
mod loo;
mod specimens;

use ppl::prelude::*;
use ppl::{
    Chains, Group, Map, Mode, Nuts, OptimizeError, Posterior, PosteriorError, Rejection, Role,
    SampleError, Values, Variable,
};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{DynPce, Input, SurrogateError};

use crate::case::MaterialParameter;
use crate::qoi::Quantity;
pub use groups::{Groups, Pooling, TestGroup, Trend, calibrate_groups, calibration_over_groups};
pub use specimens::Specimens;

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
    /// may be known of each.
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

        let (response, expected) = specimens.expected(forward, &point);
        #[dims(qoi)] #[track] let mean = response;
        // differences between specimens show their scatter alone, their mean what they share too
        for (contrast, expected) in specimens.contrasts.iter().zip(&expected) {
            contrast ~ MvNormalCholesky(expected, &chol);
        }
        let of_total = specimens.factor_of_total(&chol)?;
        specimens.total ~ MvNormalCholesky(specimens.mean_of_total(&mean), &of_total);
        #[dims(qoi)] #[predict] let new_specimen ~ specimens.new_specimen(&mean, &chol)?;
    }
}

/// A calibration that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// Covariances need at least two specimens.
    #[error("{0} specimen: a calibration with scatter between specimens needs at least two")]
    TooFew(usize),
    /// Something is known of other specimens than there are, or not the same of each.
    #[error(
        "known inputs of the forward model are given for {found} specimens, of {expected}, or not as many of each"
    )]
    Known {
        /// Number of specimens.
        expected: usize,
        /// Number of rows.
        found: usize,
    },
    /// Specimens with other quantities than the surrogate gives.
    #[error("a specimen has {found} quantities of interest, the surrogate has {expected}")]
    Quantities {
        /// Outputs of the surrogate.
        expected: usize,
        /// Values of the specimen.
        found: usize,
    },
    /// Groups of specimens that do not belong together.
    #[error("{group} {problem}")]
    Group {
        /// The group, or the parameter.
        group: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The surrogate is not one of the quantities of interest.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The sampler could not start.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The draws do not make a posterior.
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
    /// The mode could not be found.
    #[error(transparent)]
    Mode(#[from] OptimizeError),
    /// Labels that are not those of the quantities of interest.
    #[error(transparent)]
    Label(#[from] ppl::LabelError),
    /// The model rejects its own mode.
    #[error("at the mode: {0}")]
    Rejection(#[from] Rejection),
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

impl Calibration {
    /// The posterior as people know it: `mean` and `new_specimen` in the units of the surrogate's outputs,
    /// labelled by their names, and among the data the specimens `qois` by the names `ids`, in place of the
    /// contrasts that the likelihood takes; `log_likelihood` stays by those, whose sum it is. `sd` stays
    /// relative to the specimens' means.
    ///
    /// # Errors
    /// Other outputs than the calibration's, or not a name for each specimen.
    pub fn in_units(
        &self,
        outputs: &[String],
        ids: &[&str],
        qois: &[Vec<f64>],
    ) -> Result<Posterior, ppl::LabelError> {
        let means = &column_means(qois)[..];
        let mut whole = self.posterior.clone();
        let columns: Vec<&str> = outputs.iter().map(String::as_str).collect();
        whole.label("mean", 0, &columns)?;
        let replicated = |group: &mut Group| {
            group.variables.retain(|values| whole.observed.get(&values.name).is_none());
        };
        replicated(&mut whole.predictive);
        whole.prior_predictive.iter_mut().for_each(replicated);
        let (name, shape) = ("qois".to_owned(), vec![qois.len(), columns.len()]);
        whole.layout.variables.push(Variable {
            name: name.clone(),
            shape: shape.clone(),
            dims: vec!["specimen".to_owned(), "qoi".to_owned()],
            role: Role::Observed,
        });
        whole.observed.variables = vec![Values { name, shape, data: qois.concat() }];
        whole.label("qois", 0, ids)?;
        set_units(&mut whole, &self.forward, &columns)?;
        let Posterior { posterior, predictive, prior, prior_predictive, .. } = &mut whole;
        let groups = [Some(posterior), Some(predictive), prior.as_mut(), prior_predictive.as_mut()];
        for values in groups.into_iter().flatten().flat_map(|group| &mut group.variables) {
            if let "mean" | "new_specimen" = values.name.as_str() {
                for row in values.data.chunks_mut(means.len()) {
                    row.iter_mut().zip(means).for_each(|(value, mean)| *value *= mean);
                }
            }
        }
        Ok(whole)
    }
}

/// Gives quantities the units that their names say; what has none, or is relative, has 1.
fn set_units(
    posterior: &mut Posterior,
    forward: &DynPce,
    columns: &[&str],
) -> Result<(), ppl::LabelError> {
    let quantity = |name: &&str| Quantity::of_column(name).map(Quantity::unit);
    if let Some(units) = columns.iter().map(quantity).collect::<Option<Vec<&str>>>() {
        for name in ["mean", "new_specimen", "qois"] {
            posterior.set_units(name, &units)?;
        }
    }
    let parameter = |input: &Input| {
        let parameter: Option<MaterialParameter> = input.name.parse().ok();
        parameter.map(|parameter| parameter.property.unit())
    };
    // what is known of each specimen is no parameter
    let units: Vec<&str> = forward.inputs().iter().map_while(parameter).collect();
    let theta = posterior.layout.variables.iter().find(|v| v.name == "theta");
    if theta.is_some_and(|theta| theta.shape == [units.len()]) {
        posterior.set_units("theta", &units)?;
    }
    for name in ["sd", "correlation", "corr"] {
        posterior.set_units(name, &["1"])?;
    }
    Ok(())
}

/// What experiments say of the specimens.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Quantities of interest, one row a specimen, in the order of the surrogate's outputs.
    pub qois: Vec<Vec<f64>>,
    /// The surrogate's last inputs of each specimen, where they are known: the stiffness ratio of its own
    /// microstructure. Empty: all inputs are to be found.
    pub known: Vec<Vec<f64>>,
    /// Covariance of the error that all specimens share, relative to their means: that of the surrogate,
    /// the mesh and the geometry. Empty: none, the paper's likelihood.
    pub shared: Vec<Vec<f64>>,
}

/// Calibrates the inputs of a surrogate against specimens. The surrogate's box is the prior's. The sampler
/// brings chains, draws and seed; starts of the search for the mode are seeded with `seed`.
///
/// # Errors
/// Fewer than two specimens, rows or a covariance of another size, or a surrogate that rejects every start.
///
/// # Example
/// ```no_run
/// use models::{CalibrationError, Evidence, calibrate};
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
pub(crate) fn sample(
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
    let Evidence { qois, known, shared } = evidence;
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
        specimens = specimens.knowing(known.clone())?;
    }
    Ok((forward, specimens))
}

/// The name of a surrogate's output in tables, where it is relative and has no unit.
pub(crate) fn short_name(output: &str) -> String {
    Quantity::of_column(output).map_or_else(|| output.to_owned(), |quantity| quantity.to_string())
}

/// The mean of every column of rows of one length.
pub(crate) fn column_means(rows: &[Vec<f64>]) -> Vec<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    let mean = |m: usize| rows.iter().map(|row| row[m]).sum::<f64>() / rows.len() as f64;
    (0..columns).map(mean).collect()
}

/// A covariance (quantities × quantities) relative to the quantities' means.
pub(crate) fn relative_covariance(covariance: Vec<Vec<f64>>, means: &[f64]) -> Vec<Vec<f64>> {
    let row =
        |(row, a): (Vec<f64>, &f64)| row.iter().zip(means).map(|(c, b)| c / (a * b)).collect();
    covariance.into_iter().zip(means).map(row).collect()
}
