//! What a case says of its simulations, and the extent of their mesh.

use std::collections::BTreeMap;
use std::path::Path;

use fem::{ComputeDevice, Homogenisation, Order, PhaseField, Ranks, SolverOptions, TetMesh};

use crate::case::{CaseFile, ConditionsCase, InterfaceCase, MaterialCase, TestCase};

/// Parts of a case that define a simulation, except for the mesh.
#[derive(Clone, Copy)]
pub(crate) struct Setup<'a> {
    /// Path of the case file, for messages.
    pub(crate) path: &'a Path,
    pub(crate) order: Order,
    pub(crate) homogenisation: Homogenisation,
    pub(crate) material: &'a BTreeMap<String, MaterialCase>,
    pub(crate) interface: &'a BTreeMap<String, InterfaceCase>,
    pub(crate) phase_field: Option<&'a PhaseField>,
    pub(crate) test: &'a TestCase,
    /// Number of equal load steps: of the test, or of each segment of a load program for which the program does not
    /// state a number of steps. `None`: the load steps of the test are used.
    pub(crate) steps: Option<u32>,
    pub(crate) conditions: Option<&'a ConditionsCase>,
    pub(crate) solver: SolverOptions,
    /// Device that solves the linear systems; `None` for the CPU.
    pub(crate) device: Option<&'a ComputeDevice>,
    /// Ranks among which the simulation is distributed; `None` for a single process.
    pub(crate) ranks: Option<&'a Ranks>,
    /// Whether runs compute the derivatives of the force with respect to their parameters.
    pub(crate) derivatives: bool,
}

impl<'a> From<&'a CaseFile> for Setup<'a> {
    fn from(CaseFile { path, case, .. }: &'a CaseFile) -> Self {
        Self {
            path,
            order: case.specimen.order,
            homogenisation: case.specimen.homogenisation,
            material: &case.material,
            interface: &case.interface,
            phase_field: case.phase_field.as_ref(),
            test: &case.test,
            steps: None,
            conditions: case.conditions.as_ref(),
            solver: case.solver,
            device: None,
            ranks: None,
            derivatives: false,
        }
    }
}

/// The height of a mesh in mm.
pub(crate) fn height_mm(mesh: &TetMesh) -> f64 {
    let z = || mesh.nodes.iter().map(|x| x[2]);
    z().fold(f64::NEG_INFINITY, f64::max) - z().fold(f64::INFINITY, f64::min)
}

/// Largest distance of a node from the mesh's axis in mm. The axis is in the middle of the mesh's extent in x and y.
pub(crate) fn radius_mm(mesh: &TetMesh) -> f64 {
    let extent = |k: usize| {
        let values = || mesh.nodes.iter().map(move |x| x[k]);
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
    };
    let [x, y] = [0, 1].map(extent).map(|(low, high)| 0.5 * (low + high));
    mesh.nodes.iter().map(|p| (p[0] - x).hypot(p[1] - y)).fold(0.0, f64::max)
}
