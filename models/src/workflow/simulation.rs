//! From a case to a compression test.

use fem::{
    CompressionTest, CrackDensity, CurvePoint, CylinderLattice, DamageQuadrature, End, FemError,
    Friction, Irreversibility, LinearScheme, MeshError, Order, Outcome, Packing, PhaseField,
    Platens, Problem, Schedule, Scheme, SolverOptions, Split, Stepping, TetMesh, gmsh, label,
};

use super::WorkflowError;
use crate::case::{
    AdaptiveCase, ArcLengthCase, Case, CaseFile, CrackName, IrreversibilityName, LinearName,
    MaterialCase, PhaseFieldCase, PlatensName, QuadratureName, SchemeName, Shape, SolverCase,
    SplitName, TestCase,
};
use crate::experiment::Curve;
use crate::qoi::{QoiError, Qois};

/// The mesh of a case: its lattice with its packing, or its mesh file.
pub(crate) fn build_mesh(file: &CaseFile) -> Result<TetMesh, WorkflowError> {
    match file.shape()? {
        Shape::Lattice { radius_mm, height_mm, spacing_mm, grains } => {
            lattice_mesh(file, [radius_mm, height_mm, spacing_mm], grains.as_ref())
        }
        Shape::Mesh { file: path, regions, surfaces } => {
            gmsh::read(&path, &gmsh::GmshNames { regions, surfaces }).map_err(|e| match e {
                MeshError::File { .. } | MeshError::Io { .. } => e.into(),
                // what the mesh's own check finds does not know of the file
                unsound => WorkflowError::File { path, message: unsound.to_string() },
            })
        }
    }
}

/// A cylinder [radius, height, spacing] in mm with a packing of grains.
pub(crate) fn lattice_mesh(
    file: &CaseFile,
    [radius_mm, height_mm, spacing_mm]: [f64; 3],
    grains: Option<&Packing>,
) -> Result<TetMesh, WorkflowError> {
    let lattice = CylinderLattice { radius_mm, height_mm, spacing_mm };
    let path = || file.path.clone();
    let mut mesh =
        lattice.build().map_err(|source| WorkflowError::Lattice { file: path(), source })?;
    if let Some(packing) = grains.filter(|packing| packing.fraction > 0.0) {
        let grains = packing
            .fill(radius_mm, height_mm)
            .map_err(|source| WorkflowError::Packing { file: path(), source })?;
        label(&mut mesh, &grains);
    }
    Ok(mesh)
}

/// The height of a mesh in mm.
pub(crate) fn height_mm(mesh: &TetMesh) -> f64 {
    let z = || mesh.nodes.iter().map(|x| x[2]);
    z().fold(f64::NEG_INFINITY, f64::max) - z().fold(f64::INFINITY, f64::min)
}

/// The test of a case, whose calibrated region takes other parameters at every run.
#[derive(Clone, Debug)]
pub(crate) struct Simulator {
    problem: Problem,
    materials: Vec<MaterialCase>,
    calibrated: Option<usize>,
}

impl Simulator {
    /// Prepares the test of a case on a mesh.
    pub(crate) fn new(file: &CaseFile, mesh: TetMesh) -> Result<Self, WorkflowError> {
        let case = &file.case;
        let materials: Vec<MaterialCase> = mesh
            .regions
            .iter()
            .map(|region| {
                case.material.get(region).cloned().ok_or_else(|| {
                    let message = format!(
                        "the mesh's region {region:?} has no [material.{region}] in the case"
                    );
                    WorkflowError::Unusable(message)
                })
            })
            .collect::<Result<_, _>>()?;
        let region = case.prior.as_ref().map(|prior| prior.region.as_str());
        let calibrated = mesh.regions.iter().position(|r| Some(r.as_str()) == region);
        let order = if case.specimen.order == 2 { Order::Quadratic } else { Order::Linear };
        let field = case.phase_field.as_ref().map(phase_field);
        let options = solver(&case.solver);
        let problem = in_fem(&materials)
            .and_then(|materials| {
                let schedule = schedule(&case.test);
                let parts = match &case.conditions {
                    Some(conditions) => Problem::builder(mesh)
                        .conditions(conditions.in_fem(schedule.duration_s))
                        .schedule(schedule),
                    None => compression_test(&case.test).builder(mesh)?,
                };
                parts.order(order).materials(materials).phase_field(field).options(options).build()
            })
            .map_err(|source| WorkflowError::Test { file: file.path.clone(), source })?;
        Ok(Self { problem, materials, calibrated })
    }

    /// Runs with other parameters of the calibrated region, in the order of
    /// [`PriorCase::NAMES`](crate::PriorCase::NAMES).
    pub(crate) fn run(
        &self,
        parameters: &[f64],
        observer: &mut dyn fem::Observer,
    ) -> Result<Outcome, FemError> {
        let mut materials = self.materials.clone();
        if let Some(region) = self.calibrated {
            let material = &mut materials[region];
            material.young_mpa = Some(parameters[0]);
            material.toughness_n_per_mm = Some(parameters[1]);
            material.viscosity_mpa_s = parameters[2];
        }
        Ok(self.problem.with_materials(in_fem(&materials)?)?.run(observer))
    }

    /// The test with the case's own materials.
    pub(crate) fn problem(&self) -> &Problem {
        &self.problem
    }
}

/// A simulated curve as a laboratory would record it, from the unloaded start on.
pub(crate) fn recorded(points: &[CurvePoint]) -> Curve {
    let mut curve = Curve { displacement_mm: vec![0.0], force_n: vec![0.0] };
    for point in points {
        curve.displacement_mm.push(point.displacement_mm);
        curve.force_n.push(point.force_n);
    }
    curve
}

/// Quantities of interest of a simulated curve.
pub(crate) fn simulated_qois(points: &[CurvePoint], case: &Case) -> Result<Qois, QoiError> {
    Qois::of(&recorded(points), case.qoi.slope_fraction)
}

/// The share of a test that is done, for a progress bar.
pub(crate) fn share_done(point: &CurvePoint, case: &Case) -> f64 {
    point.time_s / case.test.duration_s
}

/// The error of a run that did not reach its end.
pub(crate) fn failure(end: &End) -> Option<FemError> {
    match end {
        End::Failed(error) => Some(error.clone()),
        End::Displacement | End::BelowPeak | End::Interrupted => None,
    }
}

fn in_fem(materials: &[MaterialCase]) -> Result<Vec<fem::Material>, FemError> {
    materials.iter().map(MaterialCase::in_fem).collect()
}

fn phase_field(field: &PhaseFieldCase) -> PhaseField {
    PhaseField {
        model: match field.model {
            CrackName::At2 => CrackDensity::At2,
            CrackName::At1 => CrackDensity::At1,
        },
        split: match field.split {
            SplitName::None => Split::None,
            SplitName::VolumetricDeviatoric => Split::VolumetricDeviatoric,
            SplitName::Spectral => Split::Spectral,
        },
        hybrid: field.hybrid,
        irreversibility: match field.irreversibility {
            IrreversibilityName::None => Irreversibility::None,
            IrreversibilityName::History => Irreversibility::History,
            IrreversibilityName::ActiveSet => Irreversibility::ActiveSet,
        },
        length_mm: field.length_mm,
        quadrature: match field.quadrature {
            QuadratureName::Auto => DamageQuadrature::Auto,
            QuadratureName::Vertex => DamageQuadrature::Vertex,
            QuadratureName::Consistent => DamageQuadrature::Consistent,
            QuadratureName::Eleven => DamageQuadrature::Eleven,
        },
    }
}

fn stepping(test: &TestCase) -> Stepping {
    match (test.steps, test.adaptive, test.arc_length) {
        (Some(steps), ..) => Stepping::Fixed(steps),
        (_, Some(AdaptiveCase { first, largest }), _) => Stepping::Adaptive { first, largest },
        (.., Some(ArcLengthCase { step, release_n_mm })) => {
            Stepping::ArcLength { step, release_n_mm }
        }
        _ => Stepping::adaptive(),
    }
}

fn schedule(test: &TestCase) -> Schedule {
    Schedule {
        duration_s: test.duration_s,
        stepping: stepping(test),
        stop_below_peak: test.stop_below_peak,
    }
}

fn compression_test(test: &TestCase) -> CompressionTest {
    // asked for by the case's validation wherever there are platens
    let displacement_mm = test.displacement_mm.unwrap_or(f64::NAN);
    CompressionTest::new(displacement_mm, schedule(test)).platens(platens(test))
}

fn platens(test: &TestCase) -> Platens {
    match test.platens {
        PlatensName::Sliding => Platens::Sliding,
        PlatensName::Unilateral => Platens::Unilateral(Friction {
            coefficient: test.friction,
            slip_velocity_mm_per_s: test.slip_velocity_mm_per_s,
            drag_mpa_s_per_mm: test.drag_mpa_s_per_mm,
        }),
    }
}

fn solver(case: &SolverCase) -> SolverOptions {
    SolverOptions {
        scheme: match case.scheme {
            SchemeName::Monolithic => Scheme::Monolithic,
            SchemeName::Alternate => Scheme::Alternate,
        },
        linear: match case.linear {
            LinearName::Auto => LinearScheme::Auto,
            LinearName::Direct => LinearScheme::Direct,
            LinearName::Multigrid => LinearScheme::Multigrid,
        },
        tolerance: case.tolerance,
        iterations: case.iterations,
        alternations: case.alternations,
    }
}
