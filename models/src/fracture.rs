//! The paper's calibration: three matrix parameters from the quantities of interest of specimens.

use ppl::prelude::*;
use ppl::{
    DomainError, Map, Mode, Nuts, OptimizeError, Posterior, PosteriorError, Rejection, SampleError,
};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::case::PriorCase;
use crate::qoi::{Qois, mean_qois};

ppl::model! {
    /// Matrix parameters of a bonded granular material from specimen QoIs.
    ///
    /// θ = (E, Gc, ξ) uniform on the prior box; every specimen's QoIs are normal around
    /// `forward(θ)` with one covariance diag(sd) R diag(sd): R ~ LKJ(3), sd ~ Normal(0.15, 0.25)
    /// above zero. QoIs are relative to their experimental means, so 0.15 is 15 % scatter.
    ///
    /// # Reference
    /// Paper, section "Quantities of Interest", equations of the likelihood.
    pub fn calibration<F: Differentiable<3, 3>>(forward: &F, qois: &[[f64; 3]], prior: &PriorCase) {
        let young_mpa          ~ Uniform(prior.young_mpa[0], prior.young_mpa[1]);
        let toughness_n_per_mm ~ Uniform(prior.toughness_n_per_mm[0], prior.toughness_n_per_mm[1]);
        let viscosity_mpa_s    ~ Uniform(prior.viscosity_mpa_s[0], prior.viscosity_mpa_s[1]);

        let sd   ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);

        #[track] let mean = forward.at([young_mpa, toughness_n_per_mm, viscosity_mpa_s]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
    }
}

/// A surrogate of the QoIs relative to the experimental mean of each.
///
/// # Example
/// ```
/// use models::{Qois, Relative};
/// use ppl::{Differentiable, DomainError};
///
/// struct Identity;
/// impl Differentiable<3, 3> for Identity {
///     fn value_and_jacobian(&self, x: &[f64; 3]) -> Result<([f64; 3], [[f64; 3]; 3]), DomainError> {
///         Ok((*x, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
///     }
/// }
/// let relative = Relative::new(&Identity, Qois::from([2.0, 4.0, 5.0]));
/// assert_eq!(relative.at([2.0, 2.0, 10.0]), [1.0, 0.5, 2.0]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Relative<'a, F> {
    forward: &'a F,
    scale: [f64; 3],
}

impl<'a, F: Differentiable<3, 3>> Relative<'a, F> {
    /// Divides each output of `forward` by the mean of its quantity.
    pub fn new(forward: &'a F, mean: Qois) -> Self {
        Self { forward, scale: mean.to_array().map(f64::recip) }
    }
}

impl<F: Differentiable<3, 3>> Differentiable<3, 3> for Relative<'_, F> {
    fn value_and_jacobian(&self, x: &[f64; 3]) -> Result<([f64; 3], [[f64; 3]; 3]), DomainError> {
        let (mut value, mut jacobian) = self.forward.value_and_jacobian(x)?;
        for m in 0..3 {
            value[m] *= self.scale[m];
            jacobian[m] = jacobian[m].map(|j| self.scale[m] * j);
        }
        Ok((value, jacobian))
    }

    fn value(&self, x: &[f64; 3]) -> Result<[f64; 3], DomainError> {
        let value = self.forward.value(x)?;
        Ok(std::array::from_fn(|m| self.scale[m] * value[m]))
    }
}

/// A calibration that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// Covariances need at least two specimens.
    #[error("{0} specimen: a calibration with scatter between specimens needs at least two")]
    TooFew(usize),
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

/// Posterior and mode of the paper's calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Draws, predictions, prior, log-likelihoods.
    pub posterior: Posterior,
    /// Joint mode over the constrained values (no Jacobian), in the order of [`PriorCase::NAMES`].
    pub map: [f64; 3],
    /// How the mode was found.
    pub mode: Mode,
}

/// Calibrates a forward model against the quantities of interest of specimens.
///
/// The sampler brings chains, draws and seed; starts of the search for the mode are seeded with
/// `seed`.
///
/// # Errors
/// Fewer than two specimens, or a forward model that rejects every start.
///
/// # Example
/// ```no_run
/// use models::{CalibrationError, PriorCase, Qois, calibrate};
/// use ppl::Nuts;
/// use surrogate::Pce;
///
/// fn young(pce: &Pce<3, 3>, specimens: &[Qois], prior: &PriorCase) -> Result<f64, CalibrationError> {
///     let result = calibrate(pce, specimens, prior, &Nuts::default().seed(7), 7)?;
///     println!("{}", result.posterior.summary());
///     Ok(result.map[0])
/// }
/// ```
pub fn calibrate<F: Differentiable<3, 3>>(
    forward: &F,
    specimens: &[Qois],
    prior: &PriorCase,
    sampler: &Nuts<'_>,
    seed: u64,
) -> Result<Calibration, CalibrationError> {
    if specimens.len() < 2 {
        return Err(CalibrationError::TooFew(specimens.len()));
    }
    let mean = mean_qois(specimens);
    let relative: Vec<[f64; 3]> = specimens
        .iter()
        .map(|qois| {
            let (y, m) = (qois.to_array(), mean.to_array());
            std::array::from_fn(|i| y[i] / m[i])
        })
        .collect();
    let forward = Relative::new(forward, mean);
    let model = calibration(&forward, &relative, prior);
    let chains = sampler.run(&model).map_err(SampleError::from)?;
    let mut posterior = Posterior::from_chains(&model, chains, seed)?;
    for name in ["sd", "mean", "new_specimen"] {
        posterior.label(name, 0, &Qois::NAMES)?;
    }
    let mode = Map::default().seed(seed).find(&model)?;
    let record = model.constrain(&mode.point, &mut Xoshiro256PlusPlus::seed_from_u64(seed))?;
    let map = PriorCase::NAMES.map(|name| record.values(name).map_or(f64::NAN, |v| v[0]));
    Ok(Calibration { posterior, map, mode })
}
