//! Gauge points of an extensometer.

use crate::element::Domain;
use crate::error::{FemError, Unsupported};

/// Returns nodes and weights of an extensometer: the weighted sum of the nodal displacements is the displacement of
/// the second gauge point relative to the first gauge point.
pub(super) fn gauge_of(
    domain: &dyn Domain,
    gauge_points: [[f64; 3]; 2],
) -> Result<Vec<(u32, f64)>, FemError> {
    let mut gauge = Vec::new();
    for (x, sign) in gauge_points.into_iter().zip([-1.0, 1.0]) {
        let reason = Unsupported::GaugeOutside(x);
        let at = domain.interpolation(x);
        let at = at.ok_or_else(|| FemError::unsupported("extensometer", reason))?;
        gauge.extend(at.into_iter().map(|(node, value)| (node, sign * value)));
    }
    Ok(gauge)
}
