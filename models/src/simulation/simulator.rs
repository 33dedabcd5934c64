//! The simulation of a case whose parameters are set for each run.

use fem::{
    ComputeDevice, CurvePoint, FemError, Homogenisation, Order, Outcome, Problem, Ranks, Schedule,
    SolverOptions, TetMesh, Unsupported,
};

use super::setup::Setup;
use crate::case::{
    ConditionsCase, InterfaceCase, MachineCase, Parameter, SimulationParts, TargetError,
};
use crate::results_folder::error::WorkflowError;

/// Simulation of a case whose parameters can be set for each run.
#[derive(Clone, Debug)]
pub(crate) struct Simulator {
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
    pub(crate) fn new(
        setup: &Setup<'_>,
        mut mesh: TetMesh,
        parameters: Vec<Parameter>,
    ) -> Result<Self, WorkflowError> {
        if let Some(kind) = setup.test.kind {
            let located = |reason| format!("{}: {reason}", setup.path.display());
            let added = kind.kind().add_surfaces(&mut mesh);
            added.map_err(|reason| WorkflowError::Unusable(located(reason)))?;
        }
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
    pub(crate) fn at(&self, values: &[f64]) -> Result<Problem, FemError> {
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
    pub(crate) fn check(&self, setup: &Setup<'_>, values: &[f64]) -> Result<(), WorkflowError> {
        let plain = Self { derivatives: false, ..self.clone() };
        let file = setup.path.to_owned();
        plain.at(values).map_err(|source| WorkflowError::Test { file: file.clone(), source })?;
        self.at(values).map(drop).map_err(|error| {
            WorkflowError::Unusable(format!("{}: design.derivatives: {error}", file.display()))
        })
    }

    /// Runs the test with the given parameter values.
    pub(crate) fn run(
        &self,
        values: &[f64],
        observer: &mut dyn fem::Observer,
    ) -> Result<Outcome, FemError> {
        Ok(self.at(values)?.run(observer))
    }

    /// Returns the test with the parameter values of the case.
    pub(crate) fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The fraction of the test that is done.
    pub(crate) fn fraction_done(&self, point: &CurvePoint) -> f64 {
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fem::CylinderLattice;

    use super::*;
    use crate::case::{Case, CaseFile};

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
