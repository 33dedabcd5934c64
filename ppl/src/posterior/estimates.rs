//! Estimates of single numbers of a posterior.

use super::Posterior;
use crate::diagnostics::{mean_and_variance, quantile};
use crate::quantity::format::list;

/// Error of an estimate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// The posterior has no number with this name.
    #[error("the posterior has no number `{name}`; it has {}", list(.known.iter().cloned()))]
    NoNumber {
        /// Requested name.
        name: String,
        /// Names of all numbers, in the order of the model.
        known: Vec<String>,
    },
    /// The probability is not between 0 and 1.
    #[error("a probability must lie between 0 and 1, got {value}")]
    Probability {
        /// Given value.
        value: f64,
    },
}

impl Posterior {
    /// Mean of a number, such as `young`, `sd[0]` or `sd[north]`: a parameter, a tracked quantity or a prediction.
    ///
    /// # Errors
    /// [`EstimateError::NoNumber`] with the names of all numbers.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    ///
    /// ppl::model! {
    ///     fn strength(measured: &[f64]) {
    ///         let mean ~ Uniform(100.0, 200.0); // N
    ///         for measured in measured {
    ///             measured ~ Normal(mean, 10.0);
    ///         }
    ///     }
    /// }
    /// let posterior = Nuts::default().chains(2).seed(7).sample(&strength(&[147.0, 139.5]))?;
    /// let [low, high] = posterior.interval("mean", 0.95)?;
    /// assert!(low < posterior.mean("mean")? && posterior.mean("mean")? < high);
    /// let error = posterior.mean("maen").unwrap_err();
    /// assert_eq!(error.to_string(), "the posterior has no number `maen`; it has mean, measured[0], measured[1]");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn mean(&self, name: &str) -> Result<f64, EstimateError> {
        Ok(mean_and_variance(self.draws_of(name)?.into_iter()).0)
    }

    /// Standard deviation of a number.
    ///
    /// # Errors
    /// [`EstimateError::NoNumber`] with the names of all numbers.
    pub fn sd(&self, name: &str) -> Result<f64, EstimateError> {
        Ok(mean_and_variance(self.draws_of(name)?.into_iter()).1.sqrt())
    }

    /// Quantile of a number at the probability `p`.
    ///
    /// # Errors
    /// [`EstimateError`] if there is no such number, or if `p` is not between 0 and 1.
    pub fn quantile(&self, name: &str, p: f64) -> Result<f64, EstimateError> {
        probability(p)?;
        Ok(quantile(&self.draws_of(name)?, p))
    }

    /// Central interval of a number with the probability `level`: the quantiles at (1 − level)/2 and (1 + level)/2.
    ///
    /// # Errors
    /// [`EstimateError`] if there is no such number, or if `level` is not between 0 and 1.
    pub fn interval(&self, name: &str, level: f64) -> Result<[f64; 2], EstimateError> {
        probability(level)?;
        let draws = self.draws_of(name)?;
        Ok([0.5 * (1.0 - level), 0.5 * (1.0 + level)].map(|p| quantile(&draws, p)))
    }

    /// Draws of a number, with the chains concatenated.
    fn draws_of(&self, name: &str) -> Result<Vec<f64>, EstimateError> {
        let trace = self.trace(name).ok_or_else(|| {
            let groups = [&self.posterior, &self.predictive].into_iter();
            let elements = groups.flat_map(|group| &group.variables).flat_map(|v| v.elements());
            EstimateError::NoNumber { name: name.to_owned(), known: elements.collect() }
        })?;
        Ok(trace.concat())
    }
}

fn probability(value: f64) -> Result<(), EstimateError> {
    match (0.0..=1.0).contains(&value) {
        true => Ok(()),
        false => Err(EstimateError::Probability { value }),
    }
}
