//! Counts of rejected points per location in the model.

use std::collections::BTreeMap;

use crate::density::{Location, Rejection};
use crate::model::erased::Evaluator;
use crate::sampler::run::stop::StopReason;

/// Number of rejected points per location in the model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rejections(BTreeMap<Location, u64>);

impl Rejections {
    /// Counts a rejection. If the rejection is a fatal error, returns this error and does not count it.
    pub(crate) fn count(&mut self, rejection: &Rejection) -> Result<(), StopReason> {
        match rejection {
            Rejection::Fatal(error) => return Err(StopReason::Fatal(error.clone())),
            Rejection::NotFinite { location, .. }
            | Rejection::Domain { location, .. }
            | Rejection::Reject { location, .. } => *self.0.entry(*location).or_insert(0) += 1,
        }
        Ok(())
    }

    /// Adds the counts of `others` to these counts.
    pub(crate) fn add(&mut self, others: Self) {
        for (location, count) in others.0 {
            *self.0.entry(location).or_insert(0) += count;
        }
    }

    /// Returns the log density at `y`. If the density rejects the point, counts the rejection and returns −∞.
    pub(crate) fn value(
        &mut self,
        density: &mut dyn Evaluator,
        y: &[f64],
    ) -> Result<f64, StopReason> {
        match finite(density, y) {
            Ok(value) => Ok(value),
            Err(rejection) => {
                self.count(&rejection)?;
                Ok(f64::NEG_INFINITY)
            }
        }
    }

    /// Returns the counts and resets them to zero.
    pub(crate) fn take(&mut self) -> BTreeMap<Location, u64> {
        std::mem::take(&mut self.0)
    }
}

/// Probability min(1, eˣ) of accepting a move; 0 if x is NaN.
pub(crate) fn accepting(x: f64) -> f64 {
    // `f64::min` ignores NaN
    if x.is_nan() { 0.0 } else { x.exp().min(1.0) }
}

/// Returns the log density at `y`. Returns a rejection if the log density is not finite; this check also covers
/// user-defined densities.
pub(crate) fn finite(density: &mut dyn Evaluator, y: &[f64]) -> Result<f64, Rejection> {
    let value = density.log_density(y)?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Rejection::NotFinite { location: Location::unknown(), value })
    }
}
