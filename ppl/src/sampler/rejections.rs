//! Rejected points, counted by their place in the model.

use std::collections::BTreeMap;

use crate::density::{LogDensity, Place, Rejection};

/// Why a chain ends before its last draw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Stop(pub(super) String);

/// How often each place of the model rejected a point.
#[derive(Clone, Debug, Default)]
pub(super) struct Rejections(BTreeMap<Place, u64>);

impl Rejections {
    /// Counts a rejection; a fatal error is passed on instead.
    pub(super) fn count(&mut self, rejection: &Rejection) -> Result<(), Stop> {
        let Some(place) = rejection.place() else {
            return Err(Stop(rejection.to_string()));
        };
        *self.0.entry(place).or_insert(0) += 1;
        Ok(())
    }

    /// The log density at `y`, −∞ where it rejects the point, which is counted.
    pub(super) fn value<D: LogDensity>(
        &mut self,
        density: &D,
        y: &[f64],
        workspace: &mut D::Workspace,
    ) -> Result<f64, Stop> {
        match finite(density, y, workspace) {
            Ok(value) => Ok(value),
            Err(rejection) => {
                self.count(&rejection)?;
                Ok(f64::NEG_INFINITY)
            }
        }
    }

    /// Hands over the counts so far and begins anew.
    pub(super) fn take(&mut self) -> BTreeMap<Place, u64> {
        std::mem::take(&mut self.0)
    }
}

/// The log density at `y`; one that is not finite is a rejection, whoever wrote the density.
pub(super) fn finite<D: LogDensity>(
    density: &D,
    y: &[f64],
    workspace: &mut D::Workspace,
) -> Result<f64, Rejection> {
    let value = density.log_density(y, workspace)?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Rejection::NotFinite { place: Place::unknown(), value })
    }
}
