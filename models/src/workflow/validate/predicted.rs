//! Prediction of one quantity of a new specimen, and the scatter between specimens.

use super::super::WorkflowError;
use super::super::posterior_draws::Draw;
use crate::case::ValidationCase;
use crate::qoi::Quantity;
use crate::validation::Prediction;

/// Prediction of one quantity.
pub(super) struct Predicted {
    pub(super) prediction: Prediction,
    /// Whether the prediction includes the scatter between specimens. Otherwise only the mean of the specimens can be
    /// compared.
    pub(super) is_scatter_known: bool,
}

impl Predicted {
    /// Creates the prediction from the mean over specimens and the standard deviation between specimens at each draw
    /// (`None`: unknown), and the standard deviation of the error that all specimens share.
    ///
    /// # Errors
    /// Fails if there are fewer than two draws or if a value is not finite.
    pub(super) fn new(
        means: Vec<f64>,
        scatter_sds: Option<Vec<f64>>,
        shared_sd: f64,
    ) -> Result<Self, WorkflowError> {
        let is_scatter_known = scatter_sds.is_some();
        let sds = scatter_sds.unwrap_or_else(|| vec![0.0; means.len()]);
        let prediction = Prediction::new(means, sds, shared_sd);
        let prediction = prediction.map_err(|e| WorkflowError::Unusable(e.to_string()))?;
        Ok(Self { prediction, is_scatter_known })
    }
}

/// Scatter of quantities between the specimens of a validation, relative to the means of the quantities.
pub(super) struct Scatter<'a> {
    pub(super) entry: &'a ValidationCase,
    /// Columns of the calibrated quantities.
    pub(super) calibrated: &'a [String],
    /// Relative variance between microstructures of each calibrated quantity, if it is part of the means already. It is
    /// subtracted from the calibrated variance between specimens, which includes it.
    pub(super) of_microstructures: Option<Vec<f64>>,
}

impl Scatter<'_> {
    /// Relative variance of a quantity between specimens at a draw: as stated in the case, or as calibrated; `None` if it is
    /// neither.
    pub(super) fn relative_variance(&self, quantity: &Quantity, draw: &Draw) -> Option<f64> {
        let place = self.place(&quantity.column());
        let stated = self.entry.scatter_percent.get(quantity).map(|p| (0.01 * p).powi(2));
        let variance = stated.or_else(|| place.map(|m| draw.scatter[m][m]))?;
        let included = self.of_microstructures.as_ref().zip(place).map_or(0.0, |(all, m)| all[m]);
        Some((variance - included).max(0.0))
    }

    /// Standard deviations between specimens of a quantity with the given means at the draws.
    pub(super) fn sds(
        &self,
        quantity: &Quantity,
        draws: &[&Draw],
        means: &[f64],
    ) -> Option<Vec<f64>> {
        let sd = |(draw, mean): (&&Draw, &f64)| {
            self.relative_variance(quantity, draw).map(|variance| variance.sqrt() * mean.abs())
        };
        draws.iter().zip(means).map(sd).collect()
    }

    /// Index of a calibrated quantity.
    pub(super) fn place(&self, column: &str) -> Option<usize> {
        self.calibrated.iter().position(|own| own == column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_is_as_stated_or_as_calibrated_without_that_of_microstructures() {
        let named = |name: &str| toml::Value::from(name).try_into::<Quantity>().unwrap();
        let entry: ValidationCase =
            toml::from_str("name = \"held-out\"\nscatter_percent = { peak-force = 10.0 }").unwrap();
        let [slope, peak, energy] = ["slope", "peak-force", "energy-to-peak"].map(named);
        let calibrated = [slope.column().into_owned(), peak.column().into_owned()];
        let scatter = |of_microstructures| Scatter {
            entry: &entry,
            calibrated: &calibrated,
            of_microstructures,
        };
        let draw = Draw { theta: vec![1.0], scatter: vec![vec![0.0025, 0.0], vec![0.0, 0.04]] };
        let alone = scatter(None);
        assert_eq!(alone.sds(&slope, &[&draw], &[-200.0]).unwrap(), [10.0]);
        let stated = alone.sds(&peak, &[&draw], &[30.0]).unwrap();
        assert!((stated[0] - 3.0).abs() < 1e-12, "{stated:?}");
        assert!(alone.sds(&energy, &[&draw], &[1.0]).is_none());
        // 5 % between specimens, of which 3 % between microstructures: 4 % remain
        let partly = scatter(Some(vec![0.0009, 1.0]));
        let rest = partly.relative_variance(&slope, &draw).unwrap();
        assert!((rest - 0.0016).abs() < 1e-12, "{rest}");
        assert_eq!(partly.relative_variance(&peak, &draw), Some(0.0));
    }
}
