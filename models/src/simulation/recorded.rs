//! The curve of a simulation, as a testing machine records it.

use std::iter;

use fem::{CurvePoint, RunRecord};

use crate::case::MachineCase;
use crate::experiment::TestCurve;

/// Displacements and forces of a simulation that differ by at most this fraction of the largest value count as equal. The
/// value that the load program prescribes is piecewise linear in time up to rounding errors and the tolerance of the
/// solver.
const EQUAL: f64 = 1e-6;

/// Converts a simulated curve to the form that a testing machine records: the first point is the unloaded start. Hold and
/// unloading of a load program are branches of the curve.
pub(crate) fn recorded(curve_points: &[CurvePoint]) -> TestCurve {
    let start = CurvePoint::default();
    let all = || iter::once(&start).chain(curve_points);
    let curve = TestCurve {
        displacement_mm: all().map(|point| point.displacement_mm).collect(),
        force_n: all().map(|point| point.force_n).collect(),
        time_s: all().map(|point| point.time_s).collect(),
        ..TestCurve::default()
    };
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (equal_mm, equal_n) =
        (EQUAL * largest(&curve.displacement_mm), EQUAL * largest(&curve.force_n));
    // the unloaded start has no step that ends at it; its value does not matter
    let force_is_prescribed: Vec<bool> = all().map(|point| point.force_is_prescribed).collect();
    match force_is_prescribed.contains(&true) {
        true => curve.with_force_branches(equal_mm, equal_n, &force_is_prescribed),
        false => curve.with_branches(equal_mm),
    }
}

/// Returns the curve of a run as the machine of the run records it: with the compliance and the force offset that are
/// among the inputs of the run.
pub(crate) fn recorded_run(record: &RunRecord) -> TestCurve {
    let names = record.names.iter().map(String::as_str);
    recorded_with(names.zip(record.inputs.iter().copied()), &record.curve)
}

/// Returns a simulated curve as recorded by a testing machine. The properties of the machine are among `inputs`, which are
/// pairs of name and value.
pub(crate) fn recorded_with<'a>(
    inputs: impl IntoIterator<Item = (&'a str, f64)>,
    curve_points: &[CurvePoint],
) -> TestCurve {
    MachineCase::of_inputs(inputs).machine().record(&recorded(curve_points))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::BranchKind;

    /// A purely elastic creep test: the load program prescribes the force, and the displacement is constant during the hold.
    #[test]
    fn an_elastic_creep_test_has_a_hold_of_the_force() {
        let point = |time_s: f64, force_n: f64| CurvePoint {
            time_s,
            force_n,
            displacement_mm: force_n / 700.0,
            force_is_prescribed: true,
            ..CurvePoint::default()
        };
        let ramp = (1..=5).map(|step| point(0.2 * f64::from(step), 14.0 * f64::from(step)));
        let hold = (1..=8).map(|step| point(1.0 + f64::from(step), 70.0));
        let points: Vec<CurvePoint> = ramp.chain(hold).collect();
        let kinds = |points: &[CurvePoint]| -> Vec<BranchKind> {
            recorded(points).branches.iter().map(|branch| branch.kind).collect()
        };
        assert_eq!(kinds(&points), [BranchKind::Loading, BranchKind::ForceHold]);
        let by_displacement: Vec<CurvePoint> = points
            .iter()
            .map(|point| CurvePoint { force_is_prescribed: false, ..*point })
            .collect();
        assert_eq!(kinds(&by_displacement), [BranchKind::Loading, BranchKind::Hold]);
    }
}
