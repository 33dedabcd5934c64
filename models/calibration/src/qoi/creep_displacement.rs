//! Displacement gained during a hold of the force.

use std::borrow::Cow;

use super::curve::PeakedCurve;
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::reading::{HALF_WIDTH, Reading};
use super::unit::Unit;
use crate::branch::BranchKind;

/// Displacement gained during the longest hold of the force: u(end) − u(start).
///
/// u(start) is the first reading of the hold. u(end) is read at the last time of the hold from a parabola in time
/// through the last tenth of the hold.
#[derive(Clone, Copy, Debug)]
pub struct CreepDisplacement;

impl Qoi for CreepDisplacement {
    fn name(&self) -> Cow<'static, str> {
        "creep-displacement".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "creep_displacement_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "creep displacement".into()
    }

    fn unit(&self) -> Unit {
        Unit::MM
    }

    fn is_positive(&self) -> bool {
        false
    }

    fn extent(&self) -> Extent {
        Extent::ForceHold
    }

    fn needs_peak(&self) -> bool {
        false
    }

    fn needs_time(&self) -> bool {
        true
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        let no_hold = || QoiError::NoBranch {
            quantity: self.name().into_owned(),
            branch: "hold of the force",
        };
        let hold = curve.longest(BranchKind::ForceHold).ok_or_else(no_hold)?;
        let readings = hold.readings.clone();
        let record = curve.record();
        let (times, u) = (&record.time_s[readings.clone()], &record.displacement_mm[readings]);
        let [Some(&start_s), Some(&end_s)] = [times.first(), times.last()] else {
            return Err(no_hold());
        };
        let end = Reading::of(times, u, end_s, HALF_WIDTH * (end_s - start_s));
        Ok(end.ok_or_else(no_hold)?.value - u[0])
    }
}
