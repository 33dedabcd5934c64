//! The calibration on which validations are based.

use std::collections::BTreeMap;

use crate::case::ValidationCase;
use crate::forward::fitted::Fitted;
use crate::forward::posterior_draws::Draw;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;

/// Posterior of the calibration with its surrogate.
pub(super) struct Calibrated {
    /// Names of the parameters.
    pub(super) names: Vec<String>,
    pub(super) draws: Vec<Draw>,
    /// Draws at which validations simulate their tests, by the name of the validation. Used if several tests were
    /// calibrated, for a validation whose test differs from the calibrated test.
    pub(super) elsewhere: BTreeMap<String, Vec<Draw>>,
    pub(super) fitted: Fitted,
}

impl Calibrated {
    /// Returns `n` draws, evenly spaced over all chains; all draws if there are fewer.
    pub(super) fn thinned(&self, n: usize) -> Vec<&Draw> {
        thinned(&self.draws, n)
    }

    /// Returns the draws at which a validation simulates its test.
    pub(super) fn thinned_for(&self, entry: &ValidationCase) -> Vec<&Draw> {
        thinned(self.elsewhere.get(&entry.name).unwrap_or(&self.draws), entry.draws)
    }

    /// Refuses quantities whose scatter is calibrated at known stiffness ratios. The calibrated scatter then omits the differences
    /// between the ratios of specimens, and the held-out specimens are not predicted at their own ratios.
    ///
    /// # Errors
    /// Names the quantities, and the scatter to state.
    pub(super) fn check_scatter(
        &self,
        entry: &ValidationCase,
        quantities: &[Quantity],
    ) -> Result<(), WorkflowError> {
        if self.fitted.known_stiffness.is_input() {
            refuse_calibrated_scatter(self.fitted.pce.outputs(), entry, quantities)?;
        }
        Ok(())
    }
}

/// Returns `n` draws, evenly spaced; all draws if there are fewer.
fn thinned(draws: &[Draw], n: usize) -> Vec<&Draw> {
    let n = n.min(draws.len());
    (0..n).map(|k| &draws[(2 * k + 1) * draws.len() / (2 * n)]).collect()
}

/// Refuses quantities whose scatter is calibrated and not stated in `entry`.
fn refuse_calibrated_scatter(
    calibrated: &[String],
    entry: &ValidationCase,
    quantities: &[Quantity],
) -> Result<(), WorkflowError> {
    let is_calibrated = |quantity: &&Quantity| {
        calibrated.iter().any(|column| *column == *quantity.column())
            && !entry.scatter_percent.contains_key(quantity)
    };
    let names: Vec<String> =
        quantities.iter().filter(is_calibrated).map(Quantity::to_string).collect();
    if names.is_empty() {
        return Ok(());
    }
    Err(WorkflowError::Unusable(format!(
        "the calibrated scatter of {} omits the differences between the stiffness ratios of the specimens, because calibrated \
         specimens have images: intervals of held-out specimens would be too narrow. State the standard deviation between \
         specimens as scatter_percent = {{ {} = … }}, or calibrate without the images of specimens (column image of their \
         table).",
        names.join(", "),
        names.join(" = …, "),
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_at_known_stiffness_ratios_is_refused_unless_it_is_stated() {
        let named = |name: &str| toml::Value::from(name).try_into::<Quantity>().unwrap();
        let quantities = ["slope", "peak-force", "energy-to-peak"].map(named);
        let calibrated =
            [&quantities[0], &quantities[1]].map(|quantity| quantity.column().into_owned());
        let refused = |text: &str| {
            let entry: ValidationCase =
                toml::from_str(&format!("name = \"other\"\n{text}")).unwrap();
            refuse_calibrated_scatter(&calibrated, &entry, &quantities).map_err(|e| e.to_string())
        };
        let error = refused("scatter_percent = { slope = 5.0 }").unwrap_err();
        for part in ["scatter of peak-force omits", "scatter_percent = { peak-force =", "images"] {
            assert!(error.contains(part), "{part}: {error}");
        }
        refused("scatter_percent = { slope = 5.0, peak-force = 4.0 }").unwrap();
    }
}
