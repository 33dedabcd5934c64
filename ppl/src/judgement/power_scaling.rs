//! Power-scaling sensitivity of a posterior to its prior and likelihood.

use std::fmt;

use rayon::prelude::*;

use crate::diagnostics::power_scaled;
use crate::judgement::warnings::{Warning, WarningKind, stuck};
use crate::posterior::Posterior;
use crate::quantity::draws::{Group, Values};
use crate::quantity::format::list;

/// Smallest sensitivity at which the effect of the prior or the likelihood is reported.
const THRESHOLD: f64 = 0.05;
/// Largest Pareto k at which importance weights are reliable.
const LARGEST_K: f64 = 0.7;

/// Error of a power-scaling analysis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PowerScalingError {
    /// The model has no parameter with this name.
    #[error("no parameter `{name}` whose prior can be scaled; the parameters are: {known}")]
    UnknownParameter {
        /// Requested name.
        name: String,
        /// Names of the existing parameters.
        known: String,
    },
    /// The model has no observations.
    #[error(
        "the model has no statement `place ~ D` that observes data, so that it has no likelihood"
    )]
    NoObservations,
    /// A log density is not finite at some draw.
    #[error("the log density of `{name}` is not finite at a draw")]
    NotFinite {
        /// Name of the parameter or observed quantity.
        name: String,
    },
}

/// Diagnosis of the effects of prior and likelihood on one quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensitivity {
    /// The prior has little effect.
    None,
    /// Prior and likelihood both have an effect, which indicates that they conflict.
    PriorDataConflict,
    /// The prior has an effect, and the likelihood has little effect.
    StrongPrior,
}

/// Sensitivity of one number of the posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityRow {
    /// Name with indices, such as `sd[0]`.
    pub name: String,
    /// Sensitivity to the prior: change of the distribution per doubling of the exponent of the prior.
    pub prior: f64,
    /// Sensitivity to the likelihood: change of the distribution per doubling of the exponent of the likelihood.
    pub likelihood: f64,
}

impl SensitivityRow {
    /// Returns the diagnosis from the sensitivities to prior and likelihood, with the published threshold of 0.05.
    pub fn sensitivity(&self) -> Sensitivity {
        match (self.prior >= THRESHOLD, self.likelihood >= THRESHOLD) {
            (true, true) => Sensitivity::PriorDataConflict,
            (true, false) => Sensitivity::StrongPrior,
            _ => Sensitivity::None,
        }
    }
}

/// Sensitivity of every parameter and tracked quantity to power-scaling of prior and likelihood.
///
/// See [`Posterior::power_scaling`].
#[derive(Clone, Debug, PartialEq)]
pub struct PowerScaling {
    /// One row per number that varies between draws, in the order of the model.
    pub rows: Vec<SensitivityRow>,
    /// Largest Pareto k of the importance weights for the scaled prior, and for the scaled likelihood. If one of the
    /// two is above 0.7, the sensitivities are unreliable.
    pub pareto_k: [f64; 2],
    /// Whether a chain hardly moves, or has far lower log densities than the other chains.
    has_stuck_chain: bool,
}

impl Posterior {
    /// Computes the sensitivity of the posterior to power-scaling, in which the prior or the likelihood is raised to
    /// a power near 1. The computation uses importance weights and needs no further sampling.
    ///
    /// All `let x ~ D` statements belong to the prior, all `place ~ D` statements to the likelihood. `factor` terms
    /// belong to neither and are not scaled. In a hierarchical model, the distribution of the group effects is part
    /// of the model and not a prior assumption: scale only the priors of the parameters of this distribution, with
    /// [`power_scaling_of`](Self::power_scaling_of).
    ///
    /// # Errors
    /// [`PowerScalingError`] if the model has no observations, or if a log density is not finite.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    ///
    /// ppl::model! {
    ///     fn weight(measured_kg: &[f64]) {
    ///         let mean ~ Normal(70.0, 0.5); // too sure of itself
    ///         for x in measured_kg {
    ///             x ~ Normal(mean, 2.0);
    ///         }
    ///     }
    /// }
    ///
    /// let model = weight(&[75.1, 77.3, 74.0, 76.2]);
    /// let posterior = Nuts::default().seed(1).sample(&model)?;
    /// let scaling = posterior.power_scaling().expect("the model has data");
    /// assert_eq!(scaling.rows[0].sensitivity(), ppl::Sensitivity::PriorDataConflict);
    /// println!("{scaling}");
    /// # Ok::<(), ppl::SampleError>(())
    /// ```
    ///
    /// # References
    /// Kallioinen, Paananen, Bürkner & Vehtari (2024), *Statistics and Computing* 34, 57,
    /// doi:10.1007/s11222-023-10366-5.
    pub fn power_scaling(&self) -> Result<PowerScaling, PowerScalingError> {
        let all: Vec<&Values> = self.log_prior.variables.iter().collect();
        self.scale(&all)
    }

    /// Version of [`power_scaling`](Self::power_scaling) that scales only the priors of the given parameters.
    ///
    /// # Errors
    /// [`PowerScalingError`] as in [`power_scaling`](Self::power_scaling), and if a parameter does not exist.
    pub fn power_scaling_of(&self, parameters: &[&str]) -> Result<PowerScaling, PowerScalingError> {
        let chosen: Vec<&Values> = parameters
            .iter()
            .map(|&name| {
                self.log_prior.get(name).ok_or_else(|| {
                    let names = self.log_prior.variables.iter().map(|v| v.name.as_str());
                    PowerScalingError::UnknownParameter {
                        name: name.to_owned(),
                        known: names.collect::<Vec<_>>().join(", "),
                    }
                })
            })
            .collect::<Result<_, _>>()?;
        self.scale(&chosen)
    }

    fn scale(&self, priors: &[&Values]) -> Result<PowerScaling, PowerScalingError> {
        if self.log_likelihood.variables.is_empty() {
            return Err(PowerScalingError::NoObservations);
        }
        let likelihoods: Vec<&Values> = self.log_likelihood.variables.iter().collect();
        let prior = sum_by_draw(&self.log_prior, priors)?;
        let likelihood = sum_by_draw(&self.log_likelihood, &likelihoods)?;
        let draws = self.posterior.draws;
        let named: Vec<(String, Vec<f64>)> = self
            .posterior
            .traces()
            .map(|(name, trace)| (name, trace.concat()))
            .filter(|(_, x)| x.iter().any(|&v| v != x[0]))
            .collect();
        let quantities: Vec<&[f64]> = named.iter().map(|(_, x)| x.as_slice()).collect();
        let [by_prior, by_likelihood] = [prior, likelihood].map(|part| {
            let chains: Vec<&[f64]> = part.chunks(draws).collect();
            let blocks: Vec<_> =
                quantities.par_chunks(64).map(|block| power_scaled(&chains, block)).collect();
            blocks.concat()
        });
        let largest = |rows: &[crate::diagnostics::PowerScaled]| {
            rows.iter().map(|r| r.pareto_k).fold(f64::NEG_INFINITY, f64::max)
        };
        let pareto_k = [largest(&by_prior), largest(&by_likelihood)];
        let rows = named.iter().zip(by_prior.iter().zip(&by_likelihood));
        let rows = rows.map(|((name, _), (prior, likelihood))| SensitivityRow {
            name: name.clone(),
            prior: prior.sensitivity,
            likelihood: likelihood.sensitivity,
        });
        Ok(PowerScaling {
            rows: rows.collect(),
            pareto_k,
            has_stuck_chain: stuck::is_any(&self.chains),
        })
    }
}

/// Returns, for each draw, the sum of all numbers of the given quantities; the chains are
/// concatenated.
fn sum_by_draw(group: &Group, quantities: &[&Values]) -> Result<Vec<f64>, PowerScalingError> {
    let mut sums = vec![0.0; group.chains * group.draws];
    for values in quantities {
        for (draw, sum) in sums.iter_mut().enumerate() {
            let size = values.size();
            let term: f64 = values.data[draw * size..(draw + 1) * size].iter().sum();
            if !term.is_finite() {
                return Err(PowerScalingError::NotFinite { name: values.name.clone() });
            }
            *sum += term;
        }
    }
    Ok(sums)
}

impl PowerScaling {
    /// Returns the row of the named number, such as `mu` or `sd[0]`.
    pub fn row(&self, name: &str) -> Option<&SensitivityRow> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// Warnings about conflicts and strong priors. The list is empty if a chain is stuck, because the sensitivities
    /// are then computed from draws that do not follow the posterior; the warnings of the [`Posterior`] report stuck
    /// chains.
    pub fn warnings(&self) -> Vec<Warning> {
        if self.has_stuck_chain {
            return Vec::new();
        }
        let listed = |kind: Sensitivity| {
            let rows = self.rows.iter().filter(|row| row.sensitivity() == kind);
            list(rows.map(|r| format!("{} ({:.2}, {:.2})", r.name, r.prior, r.likelihood)))
        };
        let [conflict, strong] =
            [Sensitivity::PriorDataConflict, Sensitivity::StrongPrior].map(listed);
        let mut warnings = Vec::new();
        if !conflict.is_empty() {
            warnings.push(Warning {
                kind: WarningKind::PriorDataConflict,
                what: format!(
                    "Prior and data disagree (sensitivity to prior, to likelihood): {conflict}"
                ),
                advice: "The posterior is a compromise that neither the prior nor the data \
                         support: check the prior against existing knowledge, and the data against \
                         the model",
            });
        }
        if !strong.is_empty() {
            warnings.push(Warning {
                kind: WarningKind::StrongPrior,
                what: format!(
                    "The prior dominates and the data have little effect (sensitivity to prior, to \
                     likelihood): {strong}"
                ),
                advice: "Report the prior with the result, or measure a quantity that depends on \
                         these parameters",
            });
        }
        warnings
    }
}

impl fmt::Display for PowerScaling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.rows.iter().map(|r| r.name.chars().count()).max().unwrap_or(0);
        writeln!(f, "{:width$}   prior  likelihood", "")?;
        for row in &self.rows {
            let words = match row.sensitivity() {
                Sensitivity::None => "",
                Sensitivity::PriorDataConflict => "  prior-data conflict",
                Sensitivity::StrongPrior => "  strong prior or weak likelihood",
            };
            let (prior, likelihood) = (row.prior, row.likelihood);
            writeln!(f, "{:width$}  {prior:6.3}  {likelihood:10.3}{words}", row.name)?;
        }
        let k = self.pareto_k[0].max(self.pareto_k[1]);
        if k > LARGEST_K {
            write!(f, "Pareto k is {k:.2}, above {LARGEST_K}: the sensitivities are not reliable")?;
        } else {
            write!(f, "Pareto k is {k:.2}: the importance weights are reliable")?;
        }
        Ok(())
    }
}
