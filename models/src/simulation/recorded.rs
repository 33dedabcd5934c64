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
    match curve_points.iter().any(|point| point.force_is_prescribed) {
        true => curve.with_force_branches(equal_mm, equal_n),
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
