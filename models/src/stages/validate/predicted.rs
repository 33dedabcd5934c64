//! Prediction of one quantity of a new specimen, and the scatter between specimens.

use crate::case::ValidationCase;
use crate::forward::posterior_draws::Draw;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::validation::{Prediction, PredictionError};

/// Prediction of one quantity.
pub(super) struct Predicted {
    pub(super) prediction: Prediction,
    /// Whether the prediction includes the scatter between specimens. Otherwise only the mean of the specimens can be
    /// compared.
    pub(super) is_scatter_known: bool,
}

impl Predicted {
    /// Creates the prediction of the quantity with the column `column` from the mean over specimens and the standard deviation
    /// between specimens at each draw (`None`: unknown), and the standard deviation of the error that all specimens share.
    ///
    /// # Errors
    /// Fails if there are fewer than two draws or if a value is not finite.
    pub(super) fn new(
        column: &str,
        means: Vec<f64>,
        scatter_sds: Option<Vec<f64>>,
        shared_sd: f64,
    ) -> Result<Self, WorkflowError> {
        let is_scatter_known = scatter_sds.is_some();
        let sds = scatter_sds.unwrap_or_else(|| vec![0.0; means.len()]);
        let prediction = Prediction::new(means, sds, shared_sd);
        let prediction = prediction.map_err(|error| {
            let help = match error {
                PredictionError::FewDraws(_) => "raise the number of draws of the validation or of the calibration",
                PredictionError::Lengths { .. } | PredictionError::NotFinite(_) => {
                    "look for a run without this quantity in runs.csv or in the runs of the validation, or leave the quantity \
                     out of set.qoi.quantities"
                }
            };
            WorkflowError::Unusable(format!("{column} cannot be predicted: {error}; {help}"))
        })?;
        Ok(Self { prediction, is_scatter_known })
    }

    /// Removes a variance, relative to the mean, from the means at the draws: see [`Prediction::without_variance`].
    pub(super) fn without_relative_variance(self, variance: f64) -> Self {
        let included = variance * self.prediction.mean().powi(2);
        Self { prediction: self.prediction.without_variance(included), ..self }
    }
}

/// Scatter of quantities between the specimens of a validation, relative to the means of the quantities.
pub(super) struct Scatter<'a> {
    pub(super) entry: &'a ValidationCase,
    /// Columns of the calibrated quantities.
    pub(super) calibrated: &'a [String],
    /// Relative variance of each calibrated quantity between microstructures; `None` if the means at the draws do not
    /// contain this variance. The variance between specimens contains this variance too, so that it is removed from the
    /// means.
    pub(super) of_microstructures: Option<Vec<f64>>,
    /// Means of the calibrated quantities over the calibrated specimens, if the held-out specimens are of the same test. The
    /// calibrated scatter is relative to these means. In another test the scatter is relative to the predicted means.
    pub(super) calibrated_means: Option<&'a [f64]>,
}

impl Scatter<'_> {
    /// Relative variance of a quantity between specimens at a draw: as stated in the case, or else as calibrated;
    /// `None` if the variance is neither stated nor calibrated.
    pub(super) fn relative_variance(&self, quantity: &Quantity, draw: &Draw) -> Option<f64> {
        let index = self.index_of(&quantity.column());
        let stated = self.entry.scatter_percent.get(quantity).map(|p| (0.01 * p).powi(2));
        stated.or_else(|| index.map(|m| draw.scatter[m][m]))
    }

    /// Relative variance between microstructures that the means of a quantity at the draws contain.
    pub(super) fn included_variance(&self, quantity: &Quantity) -> f64 {
        let index = self.index_of(&quantity.column());
        self.of_microstructures.as_ref().zip(index).map_or(0.0, |(all, m)| all[m])
    }

    /// Standard deviations between specimens of a quantity with the given means at the draws.
    pub(super) fn sds(
        &self,
        quantity: &Quantity,
        draws: &[&Draw],
        means: &[f64],
    ) -> Option<Vec<f64>> {
        let is_stated = self.entry.scatter_percent.contains_key(quantity);
        let base = self.calibrated_means.zip(self.index_of(&quantity.column()));
        let base = base.filter(|_| !is_stated).map(|(all, m)| all[m]);
        let sd = |(draw, mean): (&&Draw, &f64)| {
            let base = base.unwrap_or(*mean).abs();
            self.relative_variance(quantity, draw).map(|variance| variance.sqrt() * base)
        };
        draws.iter().zip(means).map(sd).collect()
    }

    /// Index of a calibrated quantity.
    pub(super) fn index_of(&self, column: &str) -> Option<usize> {
        self.calibrated.iter().position(|name| name == column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_is_as_stated_or_as_calibrated_and_is_not_shared() {
        let named = |name: &str| toml::Value::from(name).try_into::<Quantity>().unwrap();
        let entry: ValidationCase =
            toml::from_str("name = \"held-out\"\nscatter_percent = { peak-force = 10.0 }").unwrap();
        let [slope, peak, energy] = ["slope", "peak-force", "energy-to-peak"].map(named);
        let calibrated = [slope.column().into_owned(), peak.column().into_owned()];
        let scatter = |of_microstructures| Scatter {
            entry: &entry,
            calibrated: &calibrated,
            of_microstructures,
            calibrated_means: None,
        };
        let draw = Draw { theta: vec![1.0], scatter: vec![vec![0.0025, 0.0], vec![0.0, 0.04]] };
        let alone = scatter(None);
        assert_eq!(alone.sds(&slope, &[&draw], &[-200.0]).unwrap(), [10.0]);
        let stated = alone.sds(&peak, &[&draw], &[30.0]).unwrap();
        assert!((stated[0] - 3.0).abs() < 1e-12, "{stated:?}");
        assert!(alone.sds(&energy, &[&draw], &[1.0]).is_none());
        // in the same test, the calibrated scatter is relative to the calibrated mean, and the scatter stated in the
        // case is relative to the predicted mean
        let same = Scatter { calibrated_means: Some(&[-400.0, 60.0]), ..scatter(None) };
        assert_eq!(same.sds(&slope, &[&draw], &[-200.0]).unwrap(), [20.0]);
        assert_eq!(same.sds(&peak, &[&draw], &[30.0]).unwrap(), stated);
        // the means contain scatter between microstructures: this scatter is removed from the means, but not from the
        // specimens
        assert_eq!(alone.included_variance(&slope), 0.0);
        let partly = scatter(Some(vec![0.0009, 1.0]));
        assert_eq!(partly.relative_variance(&slope, &draw), Some(0.0025));
        assert_eq!(partly.included_variance(&slope), 0.0009);
        assert_eq!(partly.included_variance(&energy), 0.0);
        // means 90 and 110 have the variance 200 = 0.02 · 100², of which 100 remains
        let predicted = Predicted::new("y", vec![90.0, 110.0], Some(vec![5.0; 2]), 0.0).unwrap();
        let prediction = predicted.without_relative_variance(0.01).prediction;
        assert!((prediction.sd() - 125.0_f64.sqrt()).abs() < 1e-9, "{}", prediction.sd());
    }

    #[test]
    fn what_cannot_be_predicted_is_named_with_a_remedy() {
        let error = |means: &[f64]| {
            let predicted = Predicted::new("peak_force_N", means.to_vec(), None, 0.0);
            predicted.err().unwrap().to_string()
        };
        for (means, fragments) in [
            (vec![1.0, f64::NAN], ["peak_force_N", "NaN", "set.qoi.quantities"]),
            (vec![1.0], ["peak_force_N", "1 posterior draws", "raise the number of draws"]),
        ] {
            let message = error(&means);
            assert!(fragments.iter().all(|fragment| message.contains(fragment)), "{message}");
        }
    }
}
