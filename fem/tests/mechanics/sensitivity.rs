//! Derivatives of the force along the curve, compared with differences of whole runs, closed forms, and similarity.

use crate::support::{
    HEIGHT, RADIUS, between, grain, loading, matrix, phase_field, prism, with_options,
};
use fem::{
    Axis, CompressionTest, Conditions, CrackDensity, DamageQuadrature, End, Fracture, Friction,
    HyperelasticLaw, Irreversibility, LinearScheme, Material, MaterialParameter, Mixture, Order,
    Outcome, PhaseField, Platen, Platens, PrincipalStrain, Problem, SaintVenantKirchhoff, Scalar,
    Schedule, Scheme, SolverOptions, Split, TetMesh,
};

/// A parameter, and the materials as a function of its value.
pub(super) struct Named {
    pub(super) name: &'static str,
    value: f64,
    materials: fn(f64) -> Vec<Material>,
}

pub(super) fn named(name: &'static str, value: f64, materials: fn(f64) -> Vec<Material>) -> Named {
    Named { name, value, materials }
}

impl Named {
    fn parameter(&self) -> MaterialParameter {
        MaterialParameter::new(self.name, self.value, self.materials)
    }
}

/// Returns the material with changed fracture parameters.
fn breaking(material: Material, change: impl FnOnce(&mut Fracture)) -> Material {
    let mut fracture = material.fracture.expect("the baseline breaks");
    change(&mut fracture);
    material.with_fracture(fracture)
}

fn elastic(material: Material, young_mpa: f64, poisson: f64) -> Material {
    Material { elasticity: Material::hencky(young_mpa, poisson).elasticity, ..material }
}

/// All material constants of matrix and grain.
pub(super) fn all() -> Vec<Named> {
    vec![
        named("young", 275.0, |x| vec![elastic(matrix(), x, 0.25), grain()]),
        named("toughness", 0.0025, |x| {
            vec![breaking(matrix(), |f| f.toughness_n_per_mm = x), grain()]
        }),
        named("viscosity", 0.3, |x| vec![breaking(matrix(), |f| f.viscosity_mpa_s = x), grain()]),
        named("poisson", 0.25, |x| vec![elastic(matrix(), 275.0, x), grain()]),
        named("residual", 0.01, |x| {
            vec![breaking(matrix(), |f| f.residual_stiffness = x), grain()]
        }),
        named("grain_young", 22_000.0, |x| vec![matrix(), elastic(grain(), x, 0.25)]),
        named("grain_toughness", 1.83, |x| {
            vec![matrix(), breaking(grain(), |f| f.toughness_n_per_mm = x)]
        }),
        named("grain_viscosity", 0.1, |x| {
            vec![matrix(), breaking(grain(), |f| f.viscosity_mpa_s = x)]
        }),
    ]
}

/// A compression test of grains in a matrix.
pub(super) struct Case {
    pub(super) mesh: TetMesh,
    order: Order,
    field: PhaseField,
    pub(super) options: SolverOptions,
    pub(super) loading: CompressionTest,
}

pub(super) fn case(order: Order, field: PhaseField) -> Case {
    let cells = if order == Order::Linear { 3 } else { 2 };
    Case {
        mesh: prism(cells, true),
        order,
        field,
        options: SolverOptions { tolerance: 1e-12, ..SolverOptions::default() },
        loading: loading(0.16, 1.0, STEPS as u32),
    }
}

impl Case {
    pub(super) fn multigrid(mut self) -> Self {
        self.options.linear = LinearScheme::Multigrid;
        self
    }

    pub(super) fn problem(self, materials: Vec<Material>) -> Problem {
        let Self { mesh, order, field, options, loading } = self;
        with_options(mesh, order, materials, Some(field), loading, options).expect("valid input")
    }

    pub(super) fn of_grains(self) -> Problem {
        self.problem(vec![matrix(), grain()])
    }
}

const STEPS: usize = 8;
const FREE: Irreversibility = Irreversibility::None;
const KEPT: Irreversibility = Irreversibility::ActiveSet;

pub(super) fn forces(problem: &Problem) -> Vec<f64> {
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome.curve.iter().map(|point| point.force_n).collect()
}

pub(super) fn differentiated(problem: &Problem, parameters: &[Named]) -> Outcome {
    let with = problem.with_sensitivities(parameters.iter().map(Named::parameter).collect());
    let outcome = with.expect("valid parameters").run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let names = parameters.iter().map(|parameter| parameter.name.to_owned());
    assert_eq!(outcome.sensitivities.names, names.collect::<Vec<_>>());
    assert_eq!(outcome.sensitivities.force_n.len(), outcome.curve.len());
    outcome
}

/// Returns ∂F/∂θ at each point by the central difference of two runs, at θ (1 ± `relative_step`).
fn differences(problem: &Problem, parameter: &Named, relative_step: f64) -> Vec<f64> {
    let step = relative_step * parameter.value;
    let at = |x: f64| forces(&problem.with_materials((parameter.materials)(x)).expect("valid"));
    let pairs = at(parameter.value + step).into_iter().zip(at(parameter.value - step));
    pairs.map(|(above, below)| (above - below) / (2.0 * step)).collect()
}

/// Relative step of central differences. The step is so small that few quadrature points cross a kink of the equations,
/// and so large that errors of 1e-12 of the force are negligible.
const RELATIVE_STEP: f64 = 2e-5;

/// Checks that the derivatives agree with differences of runs to 1e-5 of the largest derivative, and that computing them
/// does not change the curve.
pub(super) fn assert_differences(problem: &Problem, parameters: &[Named], what: &str) {
    assert_differences_with_step(RELATIVE_STEP, problem, parameters, what);
}

fn assert_differences_with_step(
    relative_step: f64,
    problem: &Problem,
    parameters: &[Named],
    what: &str,
) {
    let outcome = differentiated(problem, parameters);
    for (point, force) in outcome.curve.iter().zip(forces(problem)) {
        assert!((point.force_n - force).abs() <= 1e-9 * force.abs(), "{what}: {point:?}");
    }
    for (k, parameter) in parameters.iter().enumerate() {
        let exact = differences(problem, parameter, relative_step);
        assert_eq!(exact.len(), outcome.curve.len(), "{what}");
        let size = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(size > 0.0, "{what}: {} has no influence", parameter.name);
        let rows = outcome.sensitivities.force_n.iter().zip(&exact);
        let worst = rows.fold(0.0f64, |m, (row, exact)| m.max((row[k] - exact).abs()));
        assert!(worst < 1e-5 * size, "{what}, {}: {worst:e} of {size:e}", parameter.name);
    }
}

#[test]
fn every_parameter_is_differentiated() {
    for order in [Order::Linear, Order::Quadratic] {
        let problem = case(order, phase_field(Split::None)).of_grains();
        assert_differences(&problem, &all(), &format!("{order:?}"));
    }
}

#[test]
fn every_split_and_rule_is_differentiated_with_every_solver() {
    let field = |split, model, irreversibility, quadrature| PhaseField {
        split,
        model,
        irreversibility,
        quadrature,
        ..PhaseField::new(0.06)
    };
    let (at1, at2) = (CrackDensity::At1, CrackDensity::At2);
    let (auto, gauss) = (DamageQuadrature::Auto, DamageQuadrature::Consistent);
    let fields = [
        field(Split::None, at1, FREE, auto),
        field(Split::VolumetricDeviatoric, at2, KEPT, gauss),
        field(Split::VolumetricDeviatoric, at1, KEPT, auto),
        field(Split::Spectral, at2, FREE, auto),
        field(Split::Spectral, at2, KEPT, gauss),
    ];
    for (k, field) in fields.into_iter().enumerate() {
        for order in [Order::Linear, Order::Quadratic] {
            for multigrid in [false, true] {
                let case = case(order, field);
                let problem = if multigrid { case.multigrid() } else { case }.of_grains();
                let what = format!("{field:?}, {order:?}, multigrid {multigrid}");
                assert_differences(&problem, &all()[k % 2..][..3], &what);
            }
        }
    }
}

/// The specimen is loaded, unloaded to half the displacement, and loaded further. During unloading, irreversible damage
/// is at its lower bound, and the derivative of damage is the derivative of the bound.
#[test]
fn damage_at_its_lower_bound_has_the_derivative_of_the_bound() {
    for irreversibility in [FREE, KEPT] {
        let field = PhaseField { irreversibility, ..phase_field(Split::None) };
        let down = |time_s: f64| {
            let way = if time_s < 0.4 { time_s } else { 0.4 - (time_s - 0.4).min(0.2) };
            0.3 * (way + 2.0 * (time_s - 0.6).max(0.0))
        };
        let conditions = Conditions::new()
            .fix("bottom", [Axis::Z])
            .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, -down(time_s)])
            .remove_rigid_motions()
            .measure("top", [0.0, 0.0, -1.0]);
        let mut case = case(Order::Linear, field);
        case.loading = loading(0.16, 1.0, 20);
        let problem = case.of_grains().with_conditions(conditions).expect("valid");
        assert_differences(&problem, &all()[..4], &format!("{irreversibility:?}"));
    }
}

#[test]
fn other_laws_mixtures_schemes_and_step_controllers_are_differentiated() {
    let three = || all().into_iter().take(3).collect::<Vec<_>>();
    let mut alternate = case(Order::Linear, phase_field(Split::None));
    alternate.options.scheme = Scheme::Alternate;
    alternate.options.alternations = 2000;
    alternate.options.tolerance = 1e-11;
    assert_differences(&alternate.of_grains(), &three(), "alternate minimisation");

    let mut adaptive = case(Order::Linear, phase_field(Split::None));
    adaptive.loading = CompressionTest::new(0.16, Schedule::adaptive(1.0));
    assert_differences(&adaptive.of_grains(), &three(), "adaptive steps");

    let mut mixed = case(Order::Quadratic, phase_field(Split::VolumetricDeviatoric));
    let fractions = mixed.mesh.region_of.iter().enumerate().map(|(tet, &region)| {
        let fraction = if region == 0 { [0.0, 0.3, 0.7][tet % 3] } else { 0.0 };
        Mixture { fraction, ..Mixture::default() }
    });
    mixed.mesh.mixture = Some(fractions.collect());
    assert_differences(&mixed.of_grains(), &all()[..6], "mixtures");

    fn rubber(shear_mpa: f64) -> Vec<Material> {
        let law = SaintVenantKirchhoff { lame_mpa: 110.0, shear_mpa };
        let matrix = Material::hyperelastic(law).expect("a law");
        let grain =
            Material { elasticity: Material::neo_hookean(22_000.0, 0.25).elasticity, ..grain() };
        vec![Material { fracture: crate::support::matrix().fracture, ..matrix }, grain]
    }
    let laws = case(Order::Linear, phase_field(Split::VolumetricDeviatoric));
    let shear = [named("shear", 110.0, rubber)];
    assert_differences(&laws.problem(rubber(110.0)), &shear, "user-defined law");
}

/// If all moduli, toughnesses and viscosities are multiplied by s, the force is multiplied by s: Σ θ ∂F/∂θ = F.
#[test]
fn derivatives_times_parameters_add_up_to_the_force() {
    for order in [Order::Linear, Order::Quadratic] {
        let all = all();
        let scaled: Vec<&Named> = [0, 1, 2, 5, 6, 7].map(|k| &all[k]).into();
        let problem = case(order, phase_field(Split::VolumetricDeviatoric)).of_grains();
        let parameters = scaled.iter().map(|named| named.parameter()).collect();
        let outcome = problem.with_sensitivities(parameters).expect("valid").run(&mut ());
        let rows = outcome.curve.iter().zip(&outcome.sensitivities.force_n);
        assert_eq!(rows.len(), STEPS);
        for (point, row) in rows {
            let sum: f64 = row.iter().zip(&scaled).map(|(d, named)| d * named.value).sum();
            let close = (sum - point.force_n).abs() < 1e-6 * point.force_n;
            assert!(close, "{order:?}: {sum} and {}", point.force_n);
        }
    }
}

/// AT1 without viscosity in a bar: F ∝ E for strains below ε_c = √(3 Gc/(8 ℓ₀ E)), and F ∝ Gc²/E for larger strains.
#[test]
fn a_uniform_bar_has_the_derivatives_of_its_closed_form() {
    fn bar(young_mpa: f64, toughness: f64) -> Vec<Material> {
        vec![Material::hencky(young_mpa, 0.25).with_fracture(Fracture::new(toughness))]
    }
    let (young, toughness) = (275.0, 0.0025);
    let critical = f64::sqrt(3.0 * toughness / (8.0 * 0.06 * young));
    let field =
        PhaseField { model: CrackDensity::At1, irreversibility: KEPT, ..PhaseField::new(0.06) };
    let mut bar_case = case(Order::Linear, field);
    bar_case.mesh = prism(1, false);
    bar_case.loading = loading(HEIGHT * (1.0 - f64::exp(-1.2 * critical)), 1.0, 24);
    let parameters = vec![
        MaterialParameter::new("young", young, |x| bar(x, 0.0025)),
        MaterialParameter::new("toughness", toughness, |x| bar(275.0, x)),
    ];
    let problem = bar_case.problem(bar(young, toughness)).with_sensitivities(parameters);
    let outcome = problem.expect("valid").run(&mut ());
    assert_eq!(outcome.sensitivities.force_n.len(), 24);
    let mut broken = 0;
    for (point, row) in outcome.curve.iter().zip(&outcome.sensitivities.force_n) {
        let sound = -(1.0 - point.displacement_mm / HEIGHT).ln() < critical;
        broken += usize::from(!sound);
        let [by_young, by_toughness] = if sound { [1.0, 0.0] } else { [-1.0, 2.0] };
        let force = point.force_n;
        let near = |x: f64, exact: f64| (x - exact * force).abs() < 1e-6 * force;
        assert!(
            near(young * row[0], by_young) && near(toughness * row[1], by_toughness),
            "{row:?}"
        );
    }
    assert!((3..10).contains(&broken), "{broken}");
}

/// Returns the problem with a ball that is pressed onto the top, so that more and more nodes are in contact.
fn under_a_ball(problem: &Problem) -> Problem {
    let centre = [1.1 * RADIUS, 0.8 * RADIUS, HEIGHT + 6.0];
    let ball = Platen::sphere(centre, 6.0).moving(|time_s| [0.0, 0.0, -0.25 * time_s]);
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .platen("top", ball)
        .measure("top", [0.0, 0.0, -1.0]);
    problem.with_conditions(conditions).expect("valid conditions")
}

/// Relative step of central differences with contact. The step is larger than [`RELATIVE_STEP`], because passes over
/// the contact pressures end when the forces change by less than 1e-8.
const CONTACT_RELATIVE_STEP: f64 = 5e-4;

/// Checks that the derivatives agree with differences of runs in which some nodes of a surface are in contact and some
/// are not.
fn assert_contact(problem: &Problem, surface: &str, parameters: &[Named], what: &str) {
    let contact_points = &differentiated(problem, parameters).contact[surface];
    let touching = contact_points.iter().filter(|point| point.pressure_mpa > 0.0).count();
    assert!(
        touching > 2 && touching < contact_points.len(),
        "{what}: {touching} of {}",
        contact_points.len()
    );
    assert_differences_with_step(CONTACT_RELATIVE_STEP, problem, parameters, what);
}

#[test]
fn contact_is_differentiated_with_its_pressures() {
    let case = || case(Order::Linear, phase_field(Split::None));
    let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
    let sliding = Case { options, ..case() }.of_grains();
    // some nodes of the ends of a composite lift off
    let way = loading(0.16, 1.0, STEPS as u32);
    let lifting = between(&sliding, &way, Platens::Unilateral(Friction::none()));
    assert_contact(&lifting, "top", &all()[..3], "plane");

    // use elastic materials, so that the result does not depend on steps that are reduced when a node comes into
    // contact
    let Case { mesh, order, loading, .. } = case();
    let elastic = with_options(mesh, order, vec![matrix(), grain()], None, loading, options);
    let ball = under_a_ball(&elastic.expect("valid input"));
    assert_contact(&ball, "top", &[0, 5].map(|k| all().swap_remove(k)), "ball");
}

/// Law that is stiff if the volume increases and has almost no stiffness if the volume decreases.
#[derive(Debug)]
struct Foam {
    /// Stiffness if the volume decreases, MPa.
    flat_mpa: f64,
    /// Additional bulk stiffness once the volume has decreased by 0.1 %, MPa.
    crushed_mpa: f64,
}

impl HyperelasticLaw for Foam {
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let trace = strain.log_volume();
        let crushed = trace + 1e-3;
        let squares = strain.log().map(|e| e * e);
        let sum = squares[0] + squares[1] + squares[2];
        let zero = trace.constant(0.0);
        let flat = sum * self.flat_mpa;
        let pressed = crushed * crushed * self.crushed_mpa + flat;
        let shrunk = T::select(crushed.less_than(zero), pressed, flat);
        T::select(trace.less_than(zero), shrunk, trace * trace * 50.0 + sum * 100.0)
    }
}

/// Two bodies with prescribed displacements of their surface expand and then shrink; each has one inner node. In the first
/// body, which consists of foams, the inner node then has no stiffness, or a stiffness below the rounding error of the
/// second body's stiffness. If the crushed modulus is not zero, there is a force on that node, so that the tangent is
/// singular and the derivative with respect to the crushed modulus does not exist.
#[test]
fn derivatives_end_at_a_singular_tangent_and_the_run_continues() {
    let mut mesh = prism(2, false);
    let centre = mesh.nodes[13];
    mesh.regions.extend(["upper".into(), "solid".into()]);
    for (tet, region) in mesh.tets.iter().zip(&mut mesh.region_of) {
        *region = u16::from(tet.iter().any(|&n| mesh.nodes[n as usize][2] == HEIGHT));
    }
    let faces = |t: &[u32; 4]| {
        [[t[0], t[2], t[1]], [t[0], t[1], t[3]], [t[0], t[3], t[2]], [t[1], t[2], t[3]]]
    };
    let hull: Vec<[u32; 3]> =
        mesh.tets.iter().flat_map(faces).filter(|face| !face.contains(&13)).collect();
    let twice = |face: &[u32; 3]| {
        let same = |other: &[u32; 3]| face.iter().all(|n| other.contains(n));
        hull.iter().filter(|other| same(other)).count() > 1
    };
    let level = |face: &[u32; 3]| {
        let z = face.map(|n| mesh.nodes[n as usize][2]);
        z[0] == z[1] && z[1] == z[2]
    };
    let sides = hull.iter().filter(|face| !twice(face) && !level(face)).copied().collect();
    mesh.surfaces.insert("sides".into(), sides);
    // the second body, which is solid, is a copy of the first body; both bodies have one common corner
    let (nodes, tets) = (mesh.nodes.len() as u32 - 1, mesh.tets.len());
    let (first, last) = (mesh.nodes[0], mesh.nodes[nodes as usize]);
    let copied = mesh.nodes[1..].iter().map(|x| [0, 1, 2].map(|k| x[k] + last[k] - first[k]));
    let copied: Vec<_> = copied.collect();
    mesh.nodes.extend(copied);
    mesh.tets.extend_from_within(..);
    mesh.tets[tets..].iter_mut().flatten().for_each(|n| *n += nodes);
    mesh.region_of.extend(vec![2; tets]);
    for faces in mesh.surfaces.values_mut() {
        let count = faces.len();
        faces.extend_from_within(..);
        faces[count..].iter_mut().flatten().for_each(|n| *n += nodes);
    }
    let moved = move |x: [f64; 3], time_s: f64| {
        [0, 1, 2].map(|k| 0.04 * (0.55 - time_s) * (x[k] - centre[k]))
    };
    let conditions = Conditions::new()
        .prescribe("sides", Axis::ALL, moved)
        .prescribe("bottom", Axis::ALL, moved)
        .prescribe("top", Axis::ALL, moved)
        .measure("top", [0.0, 0.0, -1.0]);
    let foams = |flat_mpa: f64, crushed_mpa: f64| {
        let foam = |crushed_mpa| Material::hyperelastic(Foam { flat_mpa, crushed_mpa });
        let [lower, upper] = [0.0, crushed_mpa].map(|x| foam(x).expect("a law"));
        vec![lower, upper, Material::hencky(275.0, 0.25)]
    };
    for (linear, flat_mpa) in [
        (LinearScheme::Direct, 0.0),
        (LinearScheme::Multigrid, 0.0),
        (LinearScheme::Direct, 1e-14),
        (LinearScheme::Multigrid, 1e-14),
    ] {
        let by_crushed = move |x| foams(flat_mpa, x);
        let problem = Problem::builder(mesh.clone())
            .materials(foams(flat_mpa, 0.0))
            .conditions(conditions.clone())
            .schedule(Schedule::fixed(1.0, 10))
            // solve accurately, because errors of the first states could not be corrected when the tangent is singular
            .options(SolverOptions { linear, linear_tolerance: 1e-10, ..SolverOptions::default() })
            .build()
            .and_then(|problem| {
                problem.with_sensitivities(vec![MaterialParameter::new("crushed", 0.0, by_crushed)])
            });
        let outcome = problem.expect("valid input").run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        assert_eq!(outcome.curve.len(), 10);
        assert_eq!(outcome.sensitivities.force_n, [[0.0]; 5], "{linear:?}, {flat_mpa}");
        let lost = outcome.sensitivities.lost.as_deref();
        assert_eq!(lost, Some("the tangent is singular"), "{linear:?}, {flat_mpa}");
    }
}

#[test]
fn sensitivities_that_are_not_supported_are_rejected_with_the_remedy() {
    let problem = |field| case(Order::Linear, field).of_grains();
    let young = || all()[0].parameter();
    let refused = |problem: &Problem, parameters: Vec<MaterialParameter>, fragments: &[&str]| {
        let message = problem.with_sensitivities(parameters).expect_err("refused").to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "'{fragment}' is not in: {message}");
        }
    };
    let plain = phase_field(Split::None);
    let snaps = crate::support::column::snap_back(CrackDensity::At2);
    let by = |x| {
        let elastic = Material::hencky(x, 0.0);
        vec![elastic.clone().with_fracture(Fracture::new(0.1)), elastic]
    };
    refused(&snaps, vec![MaterialParameter::new("young", 100.0, by)], &["arc-length", "adaptive"]);
    let sliding = problem(plain);
    let rough = Friction { coefficient: 0.1, ..Friction::none() };
    let rubs = between(&sliding, &loading(0.16, 1.0, 8), Platens::Unilateral(rough));
    refused(&rubs, vec![young()], &["friction", "without friction"]);

    refused(&sliding, vec![young(), young()], &["two parameters", "'young'"]);
    let stale =
        MaterialParameter::new("young", 300.0, |x| vec![elastic(matrix(), x, 0.25), grain()]);
    refused(
        &sliding,
        vec![stale],
        &["'young'", "'matrix'", "275", "below and above the materials"],
    );
    let none = MaterialParameter { width: 0.0, ..young() };
    refused(&sliding, vec![none], &["width = 0", "positive"]);
    let few = MaterialParameter::new("young", 275.0, |x| vec![elastic(matrix(), x, 0.25)]);
    refused(&sliding, vec![few], &["1 materials for 2 regions"]);
    let other =
        MaterialParameter { below: vec![Material::hencky(275.0, 0.25), grain()], ..young() };
    refused(&sliding, vec![other], &["'matrix'", "only some of these materials can break"]);
    let wrong = MaterialParameter { above: vec![Material::hencky(-1.0, 0.25), grain()], ..young() };
    refused(&sliding, vec![wrong], &["material.matrix", "young_mpa = -1"]);
}
