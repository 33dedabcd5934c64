//! Builds and runs the simulations of a case.

use std::collections::BTreeMap;
use std::iter;
use std::path::Path;
use std::sync::Arc;

use fem::{
    CompressionTest, ComputeDevice, CurvePoint, End, FemError, FixedSteps, Homogenisation, Order,
    Outcome, PhaseField, Problem, Ranks, RunRecord, RunStatus, SolverOptions, TetMesh,
};

use super::WorkflowError;
use crate::case::{CaseFile, ConditionsCase, MaterialCase, MaterialParameter, QoiCase, TestCase};
use crate::experiment::TestCurve;
use crate::qoi::Qois;

/// Parts of a case that define a simulation, except for the mesh.
#[derive(Clone, Copy)]
pub(super) struct Setup<'a> {
    /// The case's file, for messages.
    pub(super) path: &'a Path,
    pub(super) order: Order,
    pub(super) homogenisation: Homogenisation,
    pub(super) material: &'a BTreeMap<String, MaterialCase>,
    pub(super) phase_field: Option<&'a PhaseField>,
    pub(super) test: &'a TestCase,
    /// Number of equal load steps; `None` for the load steps of the test.
    pub(super) steps: Option<u32>,
    pub(super) conditions: Option<&'a ConditionsCase>,
    pub(super) solver: SolverOptions,
    /// Device that solves the linear systems; `None` for the CPU.
    pub(super) device: Option<&'a ComputeDevice>,
    /// Ranks among which the simulation is distributed; `None` for a single process.
    pub(super) ranks: Option<&'a Ranks>,
    /// Whether runs compute the derivatives of the force with respect to their parameters.
    pub(super) derivatives: bool,
}

impl<'a> From<&'a CaseFile> for Setup<'a> {
    fn from(CaseFile { path, case }: &'a CaseFile) -> Self {
        Self {
            path,
            order: case.specimen.order,
            homogenisation: case.specimen.homogenisation,
            material: &case.material,
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
pub(super) fn height_mm(mesh: &TetMesh) -> f64 {
    let z = || mesh.nodes.iter().map(|x| x[2]);
    z().fold(f64::NEG_INFINITY, f64::max) - z().fold(f64::INFINITY, f64::min)
}

/// Largest distance of a node from the mesh's axis in mm. The axis is in the middle of the mesh's extent in x and y.
pub(super) fn radius_mm(mesh: &TetMesh) -> f64 {
    let extent = |k: usize| {
        let values = || mesh.nodes.iter().map(move |x| x[k]);
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
    };
    let [x, y] = [0, 1].map(extent).map(|(low, high)| 0.5 * (low + high));
    mesh.nodes.iter().map(|p| (p[0] - x).hypot(p[1] - y)).fold(0.0, f64::max)
}

/// Simulation with parameters that differ between runs.
#[derive(Clone, Debug)]
pub(super) struct Simulator {
    problem: Problem,
    materials: Vec<MaterialCase>,
    /// Region of the mesh and property of each parameter.
    parameters: Vec<(usize, MaterialParameter)>,
    duration_s: f64,
    derivatives: bool,
}

impl Simulator {
    /// Prepares the test of a case on a mesh.
    pub(super) fn new(
        setup: &Setup<'_>,
        mesh: TetMesh,
        parameters: Vec<MaterialParameter>,
    ) -> Result<Self, WorkflowError> {
        let materials: Vec<MaterialCase> = mesh
            .regions
            .iter()
            .map(|region| {
                setup.material.get(region).cloned().ok_or_else(|| {
                    let message = format!(
                        "the mesh's region {region:?} has no [material.{region}] in the case"
                    );
                    WorkflowError::Unusable(message)
                })
            })
            .collect::<Result<_, _>>()?;
        let parameters = parameters
            .into_iter()
            .map(|p| {
                let region = mesh.regions.iter().position(|region| *region == p.region);
                region.map(|region| (region, p.clone())).ok_or_else(|| {
                    let known = mesh.regions.join(", ");
                    let message = format!("{p} is calibrated, but the mesh's regions are: {known}");
                    WorkflowError::Unusable(message)
                })
            })
            .collect::<Result<_, _>>()?;
        let problem = in_fem(&materials)
            .and_then(|materials| problem(setup, mesh, materials))
            .map_err(|source| WorkflowError::Test { file: setup.path.to_owned(), source })?;
        let duration_s = setup.test.duration_s;
        Ok(Self { problem, materials, parameters, duration_s, derivatives: setup.derivatives })
    }

    /// The test with these values of the parameters.
    pub(super) fn at(&self, values: &[f64]) -> Result<Problem, FemError> {
        let mut materials = self.materials.clone();
        for ((region, parameter), &value) in self.parameters.iter().zip(values) {
            materials[*region].set(parameter.property, value);
        }
        let problem = self.problem.with_materials(in_fem(&materials)?)?;
        if !self.derivatives {
            return Ok(problem);
        }
        let by = |((region, parameter), &value): (&(usize, MaterialParameter), &f64)| {
            fem::MaterialParameter::try_new(parameter.to_string(), value, |value| {
                let mut materials = materials.clone();
                materials[*region].set(parameter.property, value);
                in_fem(&materials)
            })
        };
        let parameters = self.parameters.iter().zip(values).map(by).collect::<Result<_, _>>()?;
        problem.with_sensitivities(parameters)
    }

    /// Checks that the materials and derivatives are valid at these values of the parameters. Errors name the case file
    /// of `setup`.
    pub(super) fn check(&self, setup: &Setup<'_>, values: &[f64]) -> Result<(), WorkflowError> {
        let plain = Self { derivatives: false, ..self.clone() };
        let file = setup.path.to_owned();
        plain.at(values).map_err(|source| WorkflowError::Test { file: file.clone(), source })?;
        self.at(values).map(drop).map_err(|error| {
            WorkflowError::Unusable(format!("{}: design.derivatives: {error}", file.display()))
        })
    }

    /// Runs with these values of the parameters.
    pub(super) fn run(
        &self,
        values: &[f64],
        observer: &mut dyn fem::Observer,
    ) -> Result<Outcome, FemError> {
        Ok(self.at(values)?.run(observer))
    }

    /// The test with the case's own materials.
    pub(super) fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The fraction of the test that is done.
    pub(super) fn fraction_done(&self, point: &CurvePoint) -> f64 {
        point.time_s / self.duration_s
    }
}

fn problem(
    setup: &Setup<'_>,
    mesh: TetMesh,
    materials: Vec<fem::Material>,
) -> Result<Problem, FemError> {
    let mut schedule = setup.test.schedule();
    if let Some(steps) = setup.steps {
        schedule.steps = Arc::new(FixedSteps(steps));
    }
    let parts = match setup.conditions {
        Some(conditions) => Problem::builder(mesh)
            .conditions(conditions.in_fem(schedule.duration_s))
            .schedule(schedule),
        None => {
            // the validation of the case requires this key for tests with platens
            let displacement_mm = setup.test.displacement_mm.unwrap_or(f64::NAN);
            CompressionTest::new(displacement_mm, schedule)
                .platens(setup.test.platens())
                .builder(mesh)?
        }
    };
    parts
        .order(setup.order)
        .homogenisation(setup.homogenisation)
        .materials(materials)
        .phase_field(setup.phase_field.copied())
        .options(setup.solver)
        .device(setup.device.cloned())
        .ranks(setup.ranks.cloned().unwrap_or_default())
        .build()
}

/// Simulated curve in the form that a testing machine records: the first point is the unloaded start.
pub(super) fn recorded(points: &[CurvePoint]) -> TestCurve {
    let mut curve = TestCurve { displacement_mm: vec![0.0], force_n: vec![0.0] };
    for point in points {
        curve.displacement_mm.push(point.displacement_mm);
        curve.force_n.push(point.force_n);
    }
    curve
}

/// The error of a run that did not reach its end.
pub(super) fn failure(end: &End) -> Option<FemError> {
    match end {
        End::Failed(error) => Some(error.clone()),
        End::Displacement | End::BelowPeak | End::Interrupted => None,
    }
}

fn in_fem(materials: &[MaterialCase]) -> Result<Vec<fem::Material>, FemError> {
    materials.iter().map(MaterialCase::in_fem).collect()
}

/// Quantities of interest of a run, or the reason why the run has none.
pub(super) fn quantities(record: &RunRecord, qoi: &QoiCase) -> Result<Vec<f64>, String> {
    match &record.status {
        RunStatus::Failed(reason) => Err(format!("failed: {reason}")),
        RunStatus::Finished => {
            Qois::values_of(&recorded(&record.curve), qoi.slope_fraction, &qoi.quantities)
                .map_err(|error| format!("unusable: {error}"))
        }
    }
}

/// Derivatives of the quantities of interest with respect to the parameters that the force was differentiated by,
/// quantities × parameters; or the reason why the run has none.
pub(super) fn jacobian(record: &RunRecord, qoi: &QoiCase) -> Result<Vec<Vec<f64>>, String> {
    let (curve, found) = (recorded(&record.curve), &record.sensitivities);
    if found.force_n.len() < record.curve.len() {
        return Err(format!(
            "without derivatives from {} mm on: {}",
            record.curve[found.force_n.len()].displacement_mm,
            found.lost.as_deref().unwrap_or("the run was made by another version")
        ));
    }
    let column = |parameter: usize| {
        // the force at the unloaded start does not depend on the parameters
        let rates = found.force_n.iter().map(|row| row[parameter]);
        let rates: Vec<f64> = iter::once(0.0).chain(rates).collect();
        Qois::rates_of(&curve, qoi.slope_fraction, &qoi.quantities, &rates)
            .map_err(|error| format!("without derivatives: {error}"))
    };
    let columns = (0..found.names.len()).map(column).collect::<Result<Vec<_>, _>>()?;
    let row = |quantity: usize| columns.iter().map(|column| column[quantity]).collect();
    Ok((0..qoi.quantities.len()).map(row).collect())
}
