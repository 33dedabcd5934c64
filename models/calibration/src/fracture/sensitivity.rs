//! Sensitivity of the calibrated parameters to their priors, to the priors of the scatter and to the data, by power-scaling;
//! marginal likelihood of a calibration.

use ppl::prelude::*;
use ppl::{Posterior, PowerScaling, PowerScalingError, Sensitivity, SensitivityRow, Values};
use surrogate::DynPce;

use super::likelihood::ln_density_of;
use super::loo::draws_of;
use super::specimens::Specimens;
use super::{Calibration, calibration_on};
use crate::bridge::{BridgeError, MarginalLikelihood, marginal_likelihood};

/// Sensitivity of one parameter of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorSensitivity {
    /// Name of the parameter.
    pub parameter: String,
    /// Sensitivity to the priors of all parameters: change of the parameter's distribution (cumulative Jensen–Shannon
    /// distance) per doubling of the power of these priors.
    pub prior: f64,
    /// Sensitivity to the priors of the scatter between specimens, that is, of its standard deviations and
    /// correlations.
    pub scatter_prior: f64,
    /// Sensitivity to the likelihood.
    pub likelihood: f64,
    /// Largest Pareto k of the importance weights; above 0.7 the sensitivities are unreliable.
    pub pareto_k: f64,
}

impl PriorSensitivity {
    /// Diagnosis from the sensitivities to the priors of the parameters and to the likelihood, with the published threshold
    /// of 0.05.
    pub fn diagnosis(&self) -> Sensitivity {
        let Self { prior, likelihood, .. } = *self;
        SensitivityRow { name: String::new(), prior, likelihood }.sensitivity()
    }
}

impl Calibration {
    /// Computes the sensitivity of each parameter to its prior, to the priors of the scatter and to the data.
    ///
    /// # Errors
    /// If a log density is not finite at a draw.
    pub fn prior_sensitivity(&self) -> Result<Vec<PriorSensitivity>, PowerScalingError> {
        let ln_likelihood = ln_likelihoods(&self.posterior, &self.forward, &self.specimens);
        let inputs = &self.forward.inputs()[..self.priors.len()];
        let names: Vec<String> = inputs.iter().map(|input| input.name.clone()).collect();
        sensitivities(&self.posterior, &names, ln_likelihood, &["theta"], &["sd", "corr"])
    }

    /// Estimates the marginal likelihood of the specimens' quantities, relative to the means of the specimens, from the draws.
    /// `seed` is the seed of the auxiliary draws.
    ///
    /// # Errors
    /// The errors of [`marginal_likelihood`], and too few draws for the draws of a joint calibration of several tests.
    pub fn marginal_likelihood(&self, seed: u64) -> Result<MarginalLikelihood, BridgeError> {
        let model = calibration_on(&self.forward, &self.priors, &self.specimens);
        marginal_likelihood(&model, &self.posterior.chains, seed)
    }
}

/// Computes the sensitivities of the parameters `theta` of a posterior. `names` are the names of the parameters, and
/// `ln_likelihood` is the log likelihood at each draw. `of_parameters` and `of_scatter` are the names of the variables
/// whose priors are scaled.
///
/// # Errors
/// If a log density is not finite at a draw.
///
/// # Reference
/// Kallioinen, Paananen, Bürkner & Vehtari (2024), doi:10.1007/s11222-023-10366-5.
pub(super) fn sensitivities(
    posterior: &Posterior,
    names: &[String],
    ln_likelihood: Vec<f64>,
    of_parameters: &[&str],
    of_scatter: &[&str],
) -> Result<Vec<PriorSensitivity>, PowerScalingError> {
    let mut parameters = posterior.clone();
    parameters.posterior.variables.retain(|values| values.name == "theta");
    // a likelihood that a model adds by `factor` does not count as an observation: pass the likelihood as one term
    let likelihood = Values { name: "data".to_owned(), shape: Vec::new(), data: ln_likelihood };
    parameters.log_likelihood.variables = vec![likelihood];
    let scaled = |names: &[&str]| -> Result<PowerScaling, PowerScalingError> {
        let has_prior = |name: &&&str| parameters.log_prior.get(name).is_some();
        let names: Vec<&str> = names.iter().filter(has_prior).copied().collect();
        parameters.power_scaling_of(&names)
    };
    let (by_parameters, by_scatter) = (scaled(of_parameters)?, scaled(of_scatter)?);
    let all = [by_parameters.pareto_k, by_scatter.pareto_k].concat();
    let pareto_k = all.into_iter().filter(|k| k.is_finite()).fold(0.0, f64::max);
    let rows = by_parameters.rows.iter().zip(&by_scatter.rows);
    let sensitivity = |(row, scatter): (&SensitivityRow, &SensitivityRow)| {
        let index = row.name.strip_prefix("theta[").and_then(|rest| rest.strip_suffix(']'));
        let name = index.and_then(|index| names.get(index.parse::<usize>().ok()?));
        PriorSensitivity {
            parameter: name.unwrap_or(&row.name).clone(),
            prior: row.prior,
            scatter_prior: scatter.prior,
            likelihood: row.likelihood,
            pareto_k,
        }
    };
    Ok(rows.map(sensitivity).collect())
}

/// Log likelihood of the specimens at each draw of a posterior; NaN at draws where it cannot be computed.
fn ln_likelihoods(posterior: &Posterior, forward: &DynPce, specimens: &Specimens) -> Vec<f64> {
    let at_draw = |theta: &[f64], factor: &DynCholeskyFactor<f64>| {
        let expected = specimens.expected(forward, theta)?;
        ln_density_of(specimens, &expected, factor)
    };
    let found = draws_of(posterior, forward.outputs().len()).map(|(theta, factor)| {
        factor.and_then(|factor| at_draw(theta, &factor)).unwrap_or(f64::NAN)
    });
    found.collect()
}
