//! Settings of delayed acceptance for the cheap density.

use serde::{Deserialize, Serialize};

use crate::sampler::run::error::RunError;

/// Settings of the screening by the cheap density.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Screening {
    /// Number of random-walk steps on the cheap density per screening, at least 1.
    pub(crate) steps: u32,
    /// Exponent of the cheap density in the screening, in (0, 1].
    pub(crate) power: f64,
    /// Probability that a transition is a random-walk step on the expensive density; 0 for chains that were saved
    /// before this setting existed.
    #[serde(default)]
    pub(crate) plain_share: f64,
}

impl Screening {
    /// Checks all settings.
    ///
    /// # Errors
    /// [`RunError::Setting`] if a setting is out of range.
    pub(crate) fn check(self) -> Result<(), RunError> {
        let refused = |setting, value, help| Err(RunError::Setting { setting, value, help });
        if self.steps == 0 {
            return refused("screening_steps", "0".into(), "give at least 1");
        }
        if !(self.power > 0.0 && self.power <= 1.0) {
            let help = "give a number above 0, at most 1";
            return refused("screening_power", self.power.to_string(), help);
        }
        if !(0.0..1.0).contains(&self.plain_share) {
            let help = "give a number from 0 to below 1";
            return refused("plain_share", self.plain_share.to_string(), help);
        }
        Ok(())
    }
}
