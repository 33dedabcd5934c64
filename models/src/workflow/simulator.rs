//! Builds and runs the simulations of a case.

use std::collections::BTreeMap;
use std::iter;
use std::path::Path;

use fem::{
    ComputeDevice, CurvePoint, End, FemError, Homogenisation, Order, Outcome, PhaseField, Problem,
    Ranks, RunEnd, RunRecord, RunStatus, Schedule, SolverOptions, TetMesh, Unsupported,
};

use super::WorkflowError;
use crate::case::{
    CaseFile, ConditionsCase, InterfaceCase, MachineCase, MaterialCase, Parameter, QoiComparison,
    SimulationParts, TargetError, TestCase,
};
use crate::experiment::TestCurve;
use crate::qoi::{Extent, Qois, Quantity};

/// Parts of a case that define a simulation, except for the mesh.
#[derive(Clone, Copy)]
pub(super) struct Setup<'a> {
    /// Path of the case file, for messages.
    pub(super) path: &'a Path,
    pub(super) order: Order,
    pub(super) homogenisation: Homogenisation,
    pub(super) material: &'a BTreeMap<String, MaterialCase>,
    pub(super) interface: &'a BTreeMap<String, InterfaceCase>,
    pub(super) phase_field: Option<&'a PhaseField>,
    pub(super) test: &'a TestCase,
    /// Number of equal load steps: of the test, or of each segment of a load program for which the program does not
    /// state a number of steps. `None`: the load steps of the test are used.
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

/// Simulation of a case whose parameters can be set for each run.
#[derive(Clone, Debug)]
pub(super) struct Simulator {
    problem: Problem,
    /// Parts of the case in which the parameters are set.
    simulation: SimulationParts,
    parameters: Vec<Parameter>,
    rest: Rest,
    derivatives: bool,
}

/// Parts of a simulation that no parameter changes.
#[derive(Clone, Debug)]
struct Rest {
    order: Order,
    homogenisation: Homogenisation,
    steps: Option<u32>,
    conditions: Option<ConditionsCase>,
    solver: SolverOptions,
    device: Option<ComputeDevice>,
    ranks: Option<Ranks>,
}

impl Simulator {
    /// Prepares the test of a case on a mesh.
    pub(super) fn new(
        setup: &Setup<'_>,
        mesh: TetMesh,
        parameters: Vec<Parameter>,
    ) -> Result<Self, WorkflowError> {
        let is_missing = |region: &&String| !setup.material.contains_key(*region);
        if let Some(region) = mesh.regions.iter().find(is_missing) {
            let message =
                format!("the mesh's region {region:?} has no [material.{region}] in the case");
            return Err(WorkflowError::Unusable(message));
        }
        let is_outside = |p: &&Parameter| {
            p.region().is_some_and(|calibrated_region| {
                mesh.regions.iter().all(|region| region != calibrated_region)
            })
        };
        if let Some(p) = parameters.iter().find(is_outside) {
            let region_names = mesh.regions.join(", ");
            let message = format!("{p} is calibrated, but the mesh's regions are: {region_names}");
            return Err(WorkflowError::Unusable(message));
        }
        let simulation = SimulationParts {
            material: setup.material.clone(),
            interface: setup.interface.clone(),
            phase_field: setup.phase_field.copied(),
            test: setup.test.clone(),
            machine: MachineCase::default(),
        };
        let is_idle = |name: &&String| regions_of(name, &simulation, &mesh.regions).is_none();
        for name in simulation.interface.keys().filter(is_idle) {
            let table = format!("interface.{name}.");
            if let Some(p) = parameters.iter().find(|p| p.path().starts_with(&table)) {
                let region_names = mesh.regions.join(", ");
                let message =
                    format!("{p} is calibrated, but the mesh's regions are: {region_names}");
                return Err(WorkflowError::Unusable(message));
            }
        }
        let rest = Rest {
            order: setup.order,
            homogenisation: setup.homogenisation,
            steps: setup.steps,
            conditions: setup.conditions.cloned(),
            solver: setup.solver,
            device: setup.device.cloned(),
            ranks: setup.ranks.cloned(),
        };
        let problem = problem(&rest, &simulation, mesh)
            .map_err(|source| WorkflowError::Test { file: setup.path.to_owned(), source })?;
        Ok(Self { problem, simulation, parameters, rest, derivatives: setup.derivatives })
    }

    /// Returns the test with the given parameter values.
    pub(super) fn at(&self, values: &[f64]) -> Result<Problem, FemError> {
        let simulation = self.parts_at(values)?;
        let regions = &self.problem.mesh().regions;
        let is_material = |simulation: &SimulationParts| {
            (&simulation.phase_field, &simulation.test)
                == (&self.simulation.phase_field, &self.simulation.test)
        };
        let problem = match is_material(&simulation) {
            true => {
                let problem = self.problem.with_materials(in_fem(&simulation, regions)?)?;
                match interfaces(&simulation, regions) {
                    none if none.is_empty() => problem,
                    interfaces => problem.with_interfaces(interfaces)?,
                }
            }
            false => problem(&self.rest, &simulation, self.problem.mesh().clone())?,
        };
        if !self.derivatives {
            return Ok(problem);
        }
        let by = |(i, parameter): (usize, &Parameter)| {
            let name = parameter.to_string();
            fem::MaterialParameter::try_with_interfaces(name, values[i], |value| {
                let mut values = values.to_vec();
                values[i] = value;
                let shifted = self.parts_at(&values)?;
                let others = |simulation: &SimulationParts| {
                    (simulation.phase_field, simulation.test.clone(), simulation.machine)
                };
                match others(&shifted) == others(&simulation) {
                    true => Ok((in_fem(&shifted, regions)?, interfaces(&shifted, regions))),
                    false => Err(unsupported(
                        parameter,
                        "is not a constant of a material",
                        NO_DERIVATIVE,
                    )),
                }
            })
        };
        let parameters = self.parameters.iter().enumerate().map(by).collect::<Result<_, _>>()?;
        problem.with_sensitivities(parameters)
    }

    /// Returns the parts of the case with the given parameter values.
    fn parts_at(&self, values: &[f64]) -> Result<SimulationParts, FemError> {
        let mut simulation = self.simulation.clone();
        for (parameter, &value) in self.parameters.iter().zip(values) {
            parameter.set(&mut simulation, value).map_err(|TargetError { problem, .. }| {
                unsupported(parameter, &problem, "leave the parameter out")
            })?;
        }
        Ok(simulation)
    }

    /// Checks that the materials and derivatives are valid at the given parameter values. Errors name the case
    /// file of `setup`.
    pub(super) fn check(&self, setup: &Setup<'_>, values: &[f64]) -> Result<(), WorkflowError> {
        let plain = Self { derivatives: false, ..self.clone() };
        let file = setup.path.to_owned();
        plain.at(values).map_err(|source| WorkflowError::Test { file: file.clone(), source })?;
        self.at(values).map(drop).map_err(|error| {
            WorkflowError::Unusable(format!("{}: design.derivatives: {error}", file.display()))
        })
    }

    /// Runs the test with the given parameter values.
    pub(super) fn run(
        &self,
        values: &[f64],
        observer: &mut dyn fem::Observer,
    ) -> Result<Outcome, FemError> {
        Ok(self.at(values)?.run(observer))
    }

    /// Returns the test with the parameter values of the case.
    pub(super) fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The fraction of the test that is done.
    pub(super) fn fraction_done(&self, point: &CurvePoint) -> f64 {
        point.time_s / self.simulation.test.duration_s()
    }
}

/// Help for derivatives with respect to a number outside the materials.
const NO_DERIVATIVE: &str = "leave out design.derivatives";

fn unsupported(parameter: &Parameter, problem: &str, help: &'static str) -> FemError {
    let reason = Unsupported::ByCaller { message: problem.to_owned(), help };
    FemError::Unsupported { entity: parameter.to_string(), reason }
}

fn problem(rest: &Rest, simulation: &SimulationParts, mesh: TetMesh) -> Result<Problem, FemError> {
    let materials = in_fem(simulation, &mesh.regions)?;
    let interfaces = interfaces(simulation, &mesh.regions);
    let SimulationParts { test, phase_field, .. } = simulation;
    let builder = match &rest.conditions {
        Some(conditions) => Problem::builder(mesh)
            .conditions(conditions.in_fem(test.duration_s()))
            .schedule(Schedule {
                corners_s: conditions.corners_s(test.duration_s()),
                ..test.schedule(rest.steps)
            }),
        None => test.compression(rest.steps)?.builder(mesh)?,
    };
    builder
        .order(rest.order)
        .homogenisation(rest.homogenisation)
        .materials(materials)
        .phase_field(*phase_field)
        .interfaces(interfaces)
        .options(rest.solver)
        .device(rest.device.clone())
        .ranks(rest.ranks.clone().unwrap_or_default())
        .build()
}

/// Displacements and forces of a simulation that differ by at most this fraction of the largest value count as equal. The
/// value that the load program prescribes is piecewise linear in time up to rounding errors and the tolerance of the
/// solver.
const EQUAL: f64 = 1e-6;

/// Converts a simulated curve to the form that a testing machine records: the first point is the unloaded start. Hold and
/// unloading of a load program are branches of the curve.
pub(super) fn recorded(curve_points: &[CurvePoint]) -> TestCurve {
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
pub(super) fn recorded_run(record: &RunRecord) -> TestCurve {
    let names = record.names.iter().map(String::as_str);
    recorded_with(names.zip(record.inputs.iter().copied()), &record.curve)
}

/// Returns a simulated curve as recorded by a testing machine. The properties of the machine are among `inputs`, which are
/// pairs of name and value.
pub(super) fn recorded_with<'a>(
    inputs: impl IntoIterator<Item = (&'a str, f64)>,
    curve_points: &[CurvePoint],
) -> TestCurve {
    MachineCase::of_inputs(inputs).machine().record(&recorded(curve_points))
}

/// Returns the error of a failed run.
pub(super) fn failure(end: &End) -> Option<FemError> {
    match end {
        End::Failed(error) => Some(error.clone()),
        End::Displacement | End::BelowPeak | End::LimitLoad | End::Interrupted => None,
    }
}

/// Materials of the regions of a mesh, at the temperature of the test.
fn in_fem(
    simulation: &SimulationParts,
    regions: &[String],
) -> Result<Vec<fem::Material>, FemError> {
    let at_temperature = |material: fem::Material| match simulation.test.temperature_celsius {
        Some(celsius) => material.at_temperature(celsius),
        None => material,
    };
    regions.iter().map(|region| simulation.material[region].in_fem().map(at_temperature)).collect()
}

/// The two regions of an interface; `None` if one of them is not in the mesh.
fn regions_of<'a>(
    name: &'a str,
    simulation: &SimulationParts,
    regions: &[String],
) -> Option<[&'a str; 2]> {
    let pair = InterfaceCase::regions(name, &simulation.material)?;
    pair.iter()
        .all(|region| regions.iter().any(|known_region| known_region == region))
        .then_some(pair)
}

/// Interfaces between regions of a mesh.
fn interfaces(simulation: &SimulationParts, regions: &[String]) -> Vec<fem::Interface> {
    let in_mesh = |(name, interface): (&String, &InterfaceCase)| {
        Some(interface.in_fem(regions_of(name, simulation, regions)?))
    };
    simulation.interface.iter().filter_map(in_mesh).collect()
}

/// Quantities of interest of a run, or the reason why the run has no quantities.
pub(super) fn quantities(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<f64>, String> {
    match &record.status {
        RunStatus::Failed(reason) => Err(format!("failed: {reason}")),
        RunStatus::Finished if record.curve.is_empty() => reported(record, qoi),
        RunStatus::Finished if record.end == RunEnd::LimitLoad => {
            up_to_limit_load(record, qoi).map_err(|error| format!("unusable: {error}"))
        }
        RunStatus::Finished => {
            Qois::values_of(&recorded_run(record), qoi.slope_fraction, &qoi.quantities)
                .map_err(|error| format!("unusable: {error}"))
        }
    }
}

/// Quantities of a run whose specimen does not carry the force of the load program. The branches of its curve are
/// incomplete, so that quantities of whole branches are not computed.
fn up_to_limit_load(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<f64>, String> {
    let last = record.curve.last().copied().unwrap_or_default();
    let failure = format!(
        "the specimen does not carry the force of test.program and fails after {:.4} s at {:.4} N and {:.4} mm; prescribe \
         a smaller force, or the displacement",
        last.time_s, last.force_n, last.displacement_mm
    );
    let is_of_branch = |quantity: &&Quantity| {
        matches!(quantity.extent(), Extent::Hold | Extent::ForceHold | Extent::Unloading)
    };
    if let Some(quantity) = qoi.quantities.iter().find(is_of_branch) {
        return Err(format!("{failure} ({quantity} needs the whole program)"));
    }
    Qois::values_of(&recorded_run(record), qoi.slope_fraction, &qoi.quantities)
        .map_err(|error| format!("{failure} ({error})"))
}

/// Quantities that a run without a curve reports by name.
fn reported(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<f64>, String> {
    let value = |quantity: &Quantity| {
        let column = quantity.column();
        record.values.get(&*column).copied().ok_or_else(|| {
            let names: Vec<&str> = record.values.keys().map(String::as_str).collect();
            format!("unusable: there is no {column} among the results {}", names.join(", "))
        })
    };
    qoi.quantities.iter().map(value).collect()
}

/// Derivatives of the quantities of interest with respect to the parameters of the force derivatives (quantities ×
/// parameters), or the reason why the run has no derivatives.
pub(super) fn jacobian(record: &RunRecord, qoi: &QoiComparison) -> Result<Vec<Vec<f64>>, String> {
    let (curve, derivatives) = (recorded_run(record), &record.sensitivities);
    if derivatives.force_n.len() < record.curve.len() {
        return Err(format!(
            "without derivatives from {} mm on: {}",
            record.curve[derivatives.force_n.len()].displacement_mm,
            derivatives.lost.as_deref().unwrap_or("the run was made by another version")
        ));
    }
    let column = |parameter: usize| {
        // the force at the unloaded start does not depend on the parameters
        let rates = derivatives.force_n.iter().map(|row| row[parameter]);
        let rates: Vec<f64> = iter::once(0.0).chain(rates).collect();
        let moved = derivatives.displacement_mm.iter().map(|row| row[parameter]);
        let moved: Vec<f64> = match derivatives.displacement_mm.is_empty() {
            true => Vec::new(),
            false => iter::once(0.0).chain(moved).collect(),
        };
        Qois::rates_along(&curve, qoi.slope_fraction, &qoi.quantities, &rates, &moved)
            .map_err(|error| format!("without derivatives: {error}"))
    };
    let columns = (0..derivatives.names.len()).map(column).collect::<Result<Vec<_>, _>>()?;
    let row = |quantity: usize| columns.iter().map(|column| column[quantity]).collect();
    Ok((0..qoi.quantities.len()).map(row).collect())
}

#[cfg(test)]
mod tests {
    use fem::CylinderLattice;

    use super::*;
    use crate::case::Case;

    /// A parameter outside the materials gives the same forces as a case file with this value, and other forces than
    /// the original value.
    #[test]
    fn parameters_outside_the_materials_are_set_in_the_simulation() {
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
        let mut mesh = lattice.build().unwrap();
        mesh.regions = vec!["matrix".into()];
        let text = Case::TEMPLATE.replacen("platens = \"sliding\"", "platens = \"unilateral\"", 1);
        let case = |text: &str| CaseFile::parse(text, Path::new("case.toml")).unwrap();
        let forces = |file: &CaseFile, parameter: Option<(&str, f64)>, derivatives: bool| {
            let setup = Setup { order: Order::Linear, derivatives, ..Setup::from(file) };
            let setup = Setup { steps: Some(8), ..setup };
            let paths = parameter.iter().map(|(path, _)| path.parse().unwrap()).collect();
            let simulator = Simulator::new(&setup, mesh.clone(), paths).unwrap();
            let values: Vec<f64> = parameter.iter().map(|(_, value)| *value).collect();
            let outcome = simulator.run(&values, &mut ())?;
            Ok::<_, FemError>(outcome.curve.iter().map(|p| p.force_n).collect::<Vec<f64>>())
        };
        let base = case(&text);
        for (path, written, key, value) in [
            ("phase_field.length_mm", "length_mm = 0.06", "length_mm", 0.12),
            ("test.friction", "friction = 0.0", "friction", 0.4),
        ] {
            let other = case(&text.replacen(written, &format!("{key} = {value}"), 1));
            let computed = forces(&base, Some((path, value)), false).unwrap();
            assert_eq!(computed, forces(&other, None, false).unwrap(), "{path}");
            assert_ne!(computed, forces(&base, None, false).unwrap(), "{path}");
            let refused = forces(&base, Some((path, value)), true).unwrap_err().to_string();
            assert!(refused.contains(path), "{refused}");
        }
    }

    /// The toughness of an interface is set like any other parameter, with derivatives.
    #[test]
    fn the_toughness_of_an_interface_is_set_in_the_simulation() {
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
        let mesh = lattice
            .build()
            .unwrap()
            .with_regions(&["matrix", "grain"], |[x, _, z]| u16::from(x.hypot(z - 2.2) < 1.2));
        let table =
            "[interface.matrix-grain]\ntoughness_n_per_mm = 0.001\nwidth_mm = 2.0\n\n[test]";
        let text = Case::TEMPLATE.replacen("[test]", table, 1).replacen(
            "viscosity_mpa_s = 0.3",
            "viscosity_mpa_s = 0.003",
            1,
        );
        let case = |text: &str| CaseFile::parse(text, Path::new("case.toml")).unwrap();
        let path = "interface.matrix-grain.toughness_n_per_mm";
        let outcome = |file: &CaseFile, value: Option<f64>| {
            let setup =
                Setup { order: Order::Linear, derivatives: value.is_some(), ..Setup::from(file) };
            let setup = Setup { steps: Some(8), ..setup };
            let paths = value.iter().map(|_| path.parse().unwrap()).collect();
            let simulator = Simulator::new(&setup, mesh.clone(), paths).unwrap();
            let values: Vec<f64> = value.into_iter().collect();
            simulator.run(&values, &mut ()).unwrap()
        };
        let base = case(&text);
        let other = case(&text.replacen(
            "toughness_n_per_mm = 0.001\nw",
            "toughness_n_per_mm = 0.002\nw",
            1,
        ));
        let computed = outcome(&base, Some(0.002));
        let difference = |other: &Outcome| {
            let pairs = computed.curve.iter().zip(&other.curve);
            pairs.map(|(a, b)| (a.force_n / b.force_n - 1.0).abs()).fold(0.0, f64::max)
        };
        assert!(difference(&outcome(&other, None)) < 1e-6);
        assert!(difference(&outcome(&base, None)) > 1e-4);
        assert_eq!(computed.sensitivities.names, [path]);
        assert!(computed.sensitivities.force_n.iter().any(|row| row[0] > 0.0));

        let matrix = TetMesh {
            regions: vec!["matrix".into()],
            region_of: vec![0; mesh.tets.len()],
            ..mesh.clone()
        };
        let setup = Setup::from(&base);
        assert!(Simulator::new(&setup, matrix.clone(), Vec::new()).is_ok());
        let refused = Simulator::new(&setup, matrix, vec![path.parse().unwrap()]).unwrap_err();
        assert!(refused.to_string().contains(path), "{refused}");
    }
}
