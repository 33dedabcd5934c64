//! Prior and posterior predictive checks.

use std::fmt;

use crate::diagnostics::{mean_and_variance, quantile};
use crate::posterior::Posterior;
use crate::quantity::draws::Group;

/// Error of a predictive check.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PredictiveError {
    /// The model has no observed quantity with this name.
    #[error("no observed quantity `{name}`; there are: {known}")]
    NotObserved {
        /// Requested name.
        name: String,
        /// Names of the observed quantities.
        known: String,
    },
    /// The model rejected its own prior draws.
    #[error("there are no prior predictions: the model rejected a draw from its own prior")]
    NoPrior,
}

/// One statistic of the data, with the same statistic of replicated data.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictiveCheck {
    /// Name of the observed quantity.
    pub name: String,
    /// Name of the statistic.
    pub statistic: String,
    /// Statistic of the data.
    pub observed: f64,
    /// Statistic of one replicate of the data per draw. Draws whose replicate contains NaN are omitted.
    pub replicated: Vec<f64>,
}

impl PredictiveCheck {
    fn new(
        name: &str,
        statistic: &str,
        observed: &[f64],
        replicates: &[f64],
        compute: &impl Fn(&[f64]) -> f64,
    ) -> Self {
        let size = observed.len().max(1);
        let complete = replicates.chunks(size).filter(|r| r.iter().all(|x| !x.is_nan()));
        Self {
            name: name.to_owned(),
            statistic: statistic.to_owned(),
            observed: compute(observed),
            replicated: complete.map(compute).collect(),
        }
    }

    /// Predictive p-value P(T(replicate) > T(data)) + ½ P(T(replicate) = T(data)) of the statistic T.
    ///
    /// A p-value near 0 or 1 means that the model does not reproduce this statistic of the data. For posterior
    /// replicates of a true model, the p-value is not uniform but concentrated around ½, because the data are used
    /// twice.
    ///
    /// # References
    /// Gelman, Meng & Stern (1996), *Statistica Sinica* 6, 733.
    pub fn p_value(&self) -> f64 {
        let score = |t: &f64| match t.partial_cmp(&self.observed) {
            Some(std::cmp::Ordering::Greater) => 1.0,
            Some(std::cmp::Ordering::Equal) => 0.5,
            _ => 0.0,
        };
        self.replicated.iter().map(score).sum::<f64>() / self.replicated.len() as f64
    }

    /// Quantile of the replicated statistic; `probability` in \[0, 1\].
    pub fn quantile(&self, probability: f64) -> f64 {
        quantile(&self.replicated, probability)
    }
}

/// Checks of the usual statistics of one observed quantity: mean, sd, smallest, median and largest value.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictiveTable {
    /// One check per statistic.
    pub checks: Vec<PredictiveCheck>,
}

impl PredictiveTable {
    /// Returns the check of the named statistic, such as `sd`.
    pub fn check(&self, statistic: &str) -> Option<&PredictiveCheck> {
        self.checks.iter().find(|check| check.statistic == statistic)
    }
}

impl fmt::Display for PredictiveTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.checks.first().map_or("", |check| check.name.as_str());
        writeln!(f, "{name:9} {:>10} {:>10} {:>10} {:>8}", "observed", "q05", "q95", "p")?;
        for check in &self.checks {
            let [low, high] = [0.05, 0.95].map(|p| check.quantile(p));
            let (observed, p) = (check.observed, check.p_value());
            writeln!(f, "{:9} {observed:10.4} {low:10.4} {high:10.4} {p:8.3}", check.statistic)?;
        }
        Ok(())
    }
}

impl Posterior {
    /// Compares a statistic of the observed quantity `name` with its distribution over posterior replicates:
    /// `posterior.predictive_check("y", "largest", |y| y.iter().copied().fold(f64::MIN, f64::max))`.
    ///
    /// `compute` receives all numbers of the quantity; the values of the iterations of a loop are concatenated.
    ///
    /// # Errors
    /// [`PredictiveError`] if there is no observed quantity with this name.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    ///
    /// ppl::model! {
    ///     fn arrivals(counts: &[u64]) {
    ///         let rate ~ Gamma(2.0, 0.5); // per hour
    ///         for n in counts {
    ///             n ~ Poisson(rate);
    ///         }
    ///     }
    /// }
    ///
    /// // far too many zeros for one Poisson rate
    /// let model = arrivals(&[0, 9, 0, 12, 0, 0, 11, 0, 8, 0]);
    /// let posterior = Nuts::default().seed(3).sample(&model)?;
    /// let zeros = |n: &[f64]| n.iter().filter(|&&n| n == 0.0).count() as f64;
    /// let check = posterior.predictive_check("n", "zeros", zeros).expect("observed");
    /// assert_eq!(check.observed, 6.0);
    /// assert!(check.p_value() < 0.01);
    /// # Ok::<(), ppl::SampleError>(())
    /// ```
    pub fn predictive_check(
        &self,
        name: &str,
        statistic: &str,
        compute: impl Fn(&[f64]) -> f64,
    ) -> Result<PredictiveCheck, PredictiveError> {
        self.check_against(&self.predictive, name, statistic, &compute)
    }

    /// Version of [`predictive_check`](Self::predictive_check) with replicates under the prior. The check shows
    /// whether the prior makes data like the observed data plausible.
    ///
    /// # Errors
    /// [`PredictiveError`] if there is no observed quantity with this name, or if there are no prior draws.
    pub fn prior_predictive_check(
        &self,
        name: &str,
        statistic: &str,
        compute: impl Fn(&[f64]) -> f64,
    ) -> Result<PredictiveCheck, PredictiveError> {
        let group = self.prior_predictive.as_ref().ok_or(PredictiveError::NoPrior)?;
        self.check_against(group, name, statistic, &compute)
    }

    /// Compares mean, sd, smallest, median and largest value of the observed quantity `name` with posterior replicates.
    ///
    /// # Errors
    /// [`PredictiveError`] if there is no observed quantity with this name.
    pub fn predictive_table(&self, name: &str) -> Result<PredictiveTable, PredictiveError> {
        self.table_against(&self.predictive, name)
    }

    /// Version of [`predictive_table`](Self::predictive_table) with replicates under the prior.
    ///
    /// # Errors
    /// [`PredictiveError`] if there is no observed quantity with this name, or if there are no prior draws.
    pub fn prior_predictive_table(&self, name: &str) -> Result<PredictiveTable, PredictiveError> {
        self.table_against(self.prior_predictive.as_ref().ok_or(PredictiveError::NoPrior)?, name)
    }

    fn table_against(&self, group: &Group, name: &str) -> Result<PredictiveTable, PredictiveError> {
        let moments = |y: &[f64]| mean_and_variance(y.iter().copied());
        let mut checks = vec![self.check_against(group, name, "mean", &|y| moments(y).0)?];
        // for a single number, sd is undefined and the quantiles are equal
        if self.observed.get(name).is_some_and(|values| values.size() > 1) {
            let quantiles = [("smallest", 0.0), ("median", 0.5), ("largest", 1.0)];
            checks.push(self.check_against(group, name, "sd", &|y| moments(y).1.sqrt())?);
            for (statistic, p) in quantiles {
                checks.push(self.check_against(group, name, statistic, &|y| quantile(y, p))?);
            }
        }
        Ok(PredictiveTable { checks })
    }

    fn check_against(
        &self,
        group: &Group,
        name: &str,
        statistic: &str,
        compute: &impl Fn(&[f64]) -> f64,
    ) -> Result<PredictiveCheck, PredictiveError> {
        match (self.observed.get(name), group.get(name)) {
            (Some(data), Some(replicates)) => {
                Ok(PredictiveCheck::new(name, statistic, &data.data, &replicates.data, compute))
            }
            _ => {
                let names = self.observed.variables.iter().map(|v| v.name.as_str());
                Err(PredictiveError::NotObserved {
                    name: name.to_owned(),
                    known: names.collect::<Vec<_>>().join(", "),
                })
            }
        }
    }
}
