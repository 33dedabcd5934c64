//! The result of a run.

use std::collections::BTreeMap;

use super::point::{CurvePoint, Sensitivities};
use crate::boundary::ContactPoint;
use crate::error::FemError;
use crate::fields::Fields;
use crate::solve::Effort;

/// Reason for the end of a test.
#[derive(Clone, Debug, Default)]
pub enum End {
    /// The full displacement, or the end of the schedule, was reached.
    #[default]
    Displacement,
    /// The force fell below its peak by the requested fraction.
    BelowPeak,
    /// The specimen did not carry the force that the load program prescribes, see [`LoadProgram`](crate::LoadProgram). At
    /// the next load step, the force would have fallen while the platen moved on, or more than half of the work of the
    /// step would have acted on the residual stiffness of damaged material. The curve ends at the last equilibrium, whose
    /// distance from the limit is at most a thousandth of the segment of the program.
    LimitLoad,
    /// The run was stopped before its end, e.g. by the observer.
    Interrupted,
    /// No equilibrium was found; the curve contains the points before the failure.
    Failed(FemError),
}

/// The result of a test.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One point per load step. The unloaded state at the start is not a point.
    pub curve: Vec<CurvePoint>,
    /// Derivatives of the force along the curve, if requested.
    pub sensitivities: Sensitivities,
    /// Quantities that a simulation of another program reports by name, in addition to the curve or instead of the
    /// curve. Empty for the tests of this crate.
    pub values: BTreeMap<String, f64>,
    /// Reason for the end of the test.
    pub end: End,
    /// Fields at the last point.
    pub fields: Fields,
    /// Force on the body through each surface with a condition, N, one entry per load step.
    ///
    /// The force of a surface is the sum of the reactions to its prescribed components, the contact forces of its
    /// platen, and its tractions. The sum of the forces of all surfaces and the body force is zero. If several surfaces
    /// prescribe the same component at a common node, the reaction is distributed in proportion to the area of the
    /// triangles that each surface has at the node.
    pub reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// Contact points at the last point of the curve, for each surface with a unilateral platen.
    pub contact: BTreeMap<String, Vec<ContactPoint>>,
    /// Work done by the solver.
    pub effort: Effort,
    /// Hardware that solved the linear systems, as text: name of a device, or the processor.
    pub machine: String,
}
