//! Rejected points, counted by their location in the model.

use std::collections::BTreeMap;

use super::stop::StopReason;
use crate::{
    density::{Location, Rejection},
    erased::Evaluator,
};

/// How often each location of the model rejected a point.
#[derive(Clone, Debug, Default)]
pub(super) struct Rejections(BTreeMap<Location, u64>);

impl Rejections {
    /// Counts a rejection; a fatal error is passed on instead.
    pub(super) fn count(&mut self, rejection: &Rejection) -> Result<(), StopReason> {
        match rejection {
            Rejection::Fatal(error) => return Err(StopReason::Fatal(error.clone())),
            Rejection::NotFinite { location, .. }
            | Rejection::Domain { location, .. }
            | Rejection::Reject { location, .. } => *self.0.entry(*location).or_insert(0) += 1,
        }
        Ok(())
    }

    /// Adds those counted elsewhere.
    pub(super) fn add(&mut self, others: Self) {
        for (location, count) in others.0 {
            *self.0.entry(location).or_insert(0) += count;
        }
    }

    /// The log density at `y`, −∞ where it rejects the point, which is counted.
    pub(super) fn value(
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

    /// Hands over the counts so far and begins anew.
    pub(super) fn take(&mut self) -> BTreeMap<Location, u64> {
        std::mem::take(&mut self.0)
    }
}

/// The probability min(1, eˣ) of accepting a move; never of one whose x is no number.
pub(super) fn accepting(x: f64) -> f64 {
    // `min` leaves NaN out
    if x.is_nan() { 0.0 } else { x.exp().min(1.0) }
}

/// The log density at `y`; one that is not finite is a rejection, whoever wrote the density.
pub(super) fn finite(density: &mut dyn Evaluator, y: &[f64]) -> Result<f64, Rejection> {
    let value = density.log_density(y)?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Rejection::NotFinite { location: Location::unknown(), value })
    }
}
