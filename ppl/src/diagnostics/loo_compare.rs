//! Comparison of the predictive accuracy of models.

use std::fmt;

use super::{Loo, LooError, mean_and_variance};

/// One model of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct LooRow {
    /// Name of the model.
    pub name: String,
    /// Expected log predictive density.
    pub elpd: f64,
    /// Standard error of `elpd`.
    pub se: f64,
    /// Effective number of parameters.
    pub p_loo: f64,
    /// elpd of this model minus elpd of the best model, ≤ 0.
    pub difference: f64,
    /// Standard error of `difference`, from the paired pointwise differences.
    pub difference_se: f64,
    /// Number of observations whose Pareto k is above the threshold.
    pub unreliable: usize,
}

/// Models sorted from best to worst. [`fmt::Display`] prints a table and a conclusion for each model.
#[derive(Clone, Debug, PartialEq)]
pub struct LooComparison {
    /// One row per model, best first.
    pub rows: Vec<LooRow>,
    /// Names of models whose observed data differ from the data of the best model, if both data are known. The elpd
    /// of such a model cannot be compared with the elpd of the best model. If the data were only transformed, the
    /// comparison requires the Jacobian of the transformation.
    pub other_data: Vec<String>,
}

/// Compares models that were fitted to the same observations.
///
/// The difference between a model and the best model is Σᵢ dᵢ, where dᵢ is the difference of the elpd of observation
/// i. The standard error of the difference is √(n·var(dᵢ)). This standard error is smaller than the standard errors
/// of the two elpd, because the values of the two models for one observation are correlated.
///
/// # Errors
/// [`LooError::NoObservations`] without a model, [`LooError::DifferentData`] if models have different numbers of
/// observations.
///
/// Reference: Vehtari, Gelman & Gabry (2017), equation 24, doi:10.1007/s11222-016-9696-4.
pub fn loo_compare(models: &[(&str, &Loo)]) -> Result<LooComparison, LooError> {
    let best = models
        .iter()
        .max_by(|a, b| a.1.elpd.total_cmp(&b.1.elpd))
        .ok_or(LooError::NoObservations)?;
    let mut rows = Vec::with_capacity(models.len());
    let mut other_data = Vec::new();
    for (name, loo) in models {
        if loo.points.len() != best.1.points.len() {
            return Err(LooError::DifferentData {
                first: best.0.to_string(),
                other: (*name).to_string(),
                expected: best.1.points.len(),
                got: loo.points.len(),
            });
        }
        if loo.data.zip(best.1.data).is_some_and(|(data, best_data)| data != best_data) {
            other_data.push((*name).to_string());
        }
        let paired = loo.points.iter().zip(&best.1.points).map(|(a, b)| a.elpd - b.elpd);
        let n = loo.points.len() as f64;
        let (mean, variance) = mean_and_variance(paired);
        rows.push(LooRow {
            name: (*name).to_string(),
            elpd: loo.elpd,
            se: loo.se,
            p_loo: loo.p_loo,
            difference: n * mean,
            difference_se: (n * variance).sqrt(),
            unreliable: loo.unreliable().len(),
        });
    }
    rows.sort_by(|a, b| b.elpd.total_cmp(&a.elpd));
    Ok(LooComparison { rows, other_data })
}

impl fmt::Display for LooComparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.rows.iter().map(|r| r.name.chars().count()).max().unwrap_or(0).max(5);
        writeln!(
            f,
            "{:<width$} {:>9} {:>7} {:>7} {:>9} {:>7} {:>6}",
            "model", "elpd", "se", "p_loo", "elpd diff", "se diff", "bad k"
        )?;
        for r in &self.rows {
            writeln!(
                f,
                "{:<width$} {:>9.2} {:>7.2} {:>7.2} {:>9.2} {:>7.2} {:>6}",
                r.name, r.elpd, r.se, r.p_loo, r.difference, r.difference_se, r.unreliable
            )?;
        }
        let Some((best, others)) = self.rows.split_first() else {
            return Ok(());
        };
        for r in others {
            let words = if r.difference > -4.0 {
                "predict about equally well; prefer the simpler one"
            } else if r.difference.abs() > 2.0 * r.difference_se {
                "differ: the first predicts better"
            } else {
                "cannot be distinguished with these data: the difference is within two standard errors"
            };
            writeln!(f, "{} and {} {words}.", best.name, r.name)?;
        }
        if !self.other_data.is_empty() {
            let names = self.other_data.join(", ");
            writeln!(
                f,
                "Observations differ from those of {}: {names}. Compare models of the same data only.",
                best.name
            )?;
        }
        if self.rows.iter().any(|r| r.unreliable > 0) {
            writeln!(f, "Some Pareto k are too large: the elpd of these models may be too high.")?;
        }
        Ok(())
    }
}
