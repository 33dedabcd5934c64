//! Preparation of a measured curve: the part of its record from which quantities are computed.

use super::experiment_inputs;
use crate::case::{ProgramPointCase, Toe};
use crate::curve_check::{
    CheckedProgram, Finding, InspectedCurve, ProgramLoad, ProgramSegment, Weight, inspect_confined,
};
use crate::experiment::TestCurve;
use crate::machine::Machine;
use crate::pipeline::inputs::Inputs;

/// Preparation of the measured curves of a case.
#[derive(Clone, Debug)]
pub(crate) struct Preparation {
    toe: Toe,
    /// The load program of the test, if any: readings of hold and unloading are then not removed.
    program: Option<CheckedProgram>,
    machine: Machine,
    /// Time in s for which other loads act before the displacement of `[conditions]` begins.
    confined_s: Option<f64>,
}

impl Preparation {
    /// The preparation of a case.
    pub(crate) fn of(inputs: &Inputs<'_>) -> Self {
        let needs_peak = || inputs.qoi().quantities.iter().any(|quantity| quantity.needs_peak());
        let program = inputs.test().program.as_ref().map(|program| CheckedProgram {
            segments: program.iter().map(segment).collect(),
            // reading the key makes it an input of the stage
            needs_peak: needs_peak(),
        });
        let machine = experiment_inputs::known_machine(inputs).machine();
        let conditions = inputs.conditions().as_ref();
        let confined_s =
            conditions.and_then(|conditions| conditions.confined_s(inputs.test().duration_s()));
        Self { toe: experiment_inputs::toe(inputs), program, machine, confined_s }
    }

    /// Whether displacements are measured from the displacement at which the force begins to rise.
    pub(crate) fn corrects_toe(&self) -> bool {
        self.toe == Toe::Correct
    }

    /// Returns the curve of the specimen, without compliance and force offset of the machine.
    pub(crate) fn specimen_curve(&self, record: &TestCurve) -> TestCurve {
        self.machine.specimen(record)
    }

    /// Returns the curve from which quantities are computed, and the findings. At constant speed the curve ends where
    /// loading ends; with `experiments.toe = "correct"`, the curve begins where the load begins. With a load program,
    /// the curve has all branches.
    pub(crate) fn apply(
        &self,
        record: &TestCurve,
        slope_fraction: f64,
    ) -> (TestCurve, Vec<Finding>) {
        if let Some(program) = &self.program {
            let seen = InspectedCurve::of_program(record, &self.machine, slope_fraction, program);
            return (seen.prepared, seen.findings);
        }
        let curve = self.specimen_curve(record);
        if let Some(confined_s) = self.confined_s {
            let seen = inspect_confined(&curve, slope_fraction, confined_s);
            return (seen.prepared, seen.findings);
        }
        let mut seen = InspectedCurve::of(&curve, slope_fraction);
        if !self.corrects_toe() {
            return (seen.prepared, seen.findings);
        }
        let (curve, moved) = seen.without_toe(slope_fraction);
        if let Some(late) = seen.findings.iter_mut().find(|finding| finding.name == "late-load") {
            late.weight = Weight::Note;
            late.help = "Displacement is counted from there.";
        }
        let toe = seen.findings.iter_mut().find(|finding| finding.name == "toe");
        if let Some(toe) = toe {
            toe.value = moved;
            toe.problem = format!("begins to carry load at {moved:.4} mm");
            toe.help = "Displacement is counted from there.";
            toe.weight = Weight::Note;
        }
        (curve, seen.findings)
    }
}

/// Segment of the load program that ends at a point.
fn segment(point: &ProgramPointCase) -> ProgramSegment {
    let ProgramPointCase { time_s, displacement_mm, force_n, .. } = *point;
    let end = match force_n {
        Some(force_n) => ProgramLoad::Force(force_n),
        None => ProgramLoad::Displacement(displacement_mm.unwrap_or_default()),
    };
    ProgramSegment { end_s: time_s, end }
}
