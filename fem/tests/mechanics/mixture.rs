//! Mixtures (tetrahedra that are partly grain), and grains that do not break.

use crate::support::block::{block, even};
use fem::{
    Axis, Conditions, FemError, Fields, Homogenisation, Material, Mixture, Order, PhaseField,
    Problem, Schedule, SolverOptions, TetMesh,
};

const SIDES: [&str; 4] = ["left", "right", "front", "back"];

/// Compression test between frictionless lateral walls, so that every layer is strained along the axis only.
fn confined(
    mesh: TetMesh,
    order: Order,
    materials: impl Into<Vec<Material>>,
    field: Option<PhaseField>,
    strain: f64,
) -> Result<Problem, FemError> {
    let walls = SIDES.iter().fold(Conditions::new(), |c, side| c.symmetry(side));
    let conditions = walls
        .symmetry("bottom")
        .prescribe("top", [Axis::Z], move |_, t| [0.0, 0.0, -strain * t])
        .measure("top", [0.0, 0.0, -1.0]);
    Problem::builder(mesh)
        .order(order)
        .materials(materials.into())
        .homogenisation(Homogenisation::Reuss)
        .phase_field(field)
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 4))
        .options(SolverOptions { tolerance: 1e-12, ..SolverOptions::default() })
        .build()
}

fn cube() -> TetMesh {
    let cells = even(0.0, 1.0, 4);
    block([&cells, &cells, &cells])
}

/// Mesh of layers of equal height, alternately matrix and grain.
fn layers() -> TetMesh {
    let mut mesh = cube();
    mesh.regions = vec!["matrix".into(), "grain".into()];
    for tet in 0..mesh.tets.len() {
        let height: f64 = mesh.corners(tet).iter().map(|x| 0.25 * x[2]).sum();
        mesh.region_of[tet] = (4.0 * height) as u16 % 2;
    }
    mesh
}

fn mixed(fraction: f32) -> TetMesh {
    let mut mesh = cube();
    mesh.regions = vec!["matrix".into(), "grain".into()];
    mesh.mixture = Some(vec![Mixture { fraction, ..Mixture::default() }; mesh.tets.len()]);
    mesh
}

fn phases() -> [Material; 2] {
    [crate::support::matrix(), Material::hencky(22_000.0, 0.25)]
}

fn last(problem: &Problem) -> (f64, Fields) {
    let outcome = problem.run(&mut ());
    let force = outcome.curve.last().expect("a curve").force_n;
    assert_eq!(outcome.curve.len(), 4, "{:?}", outcome.end);
    (force, outcome.fields)
}

/// A mesh of layers and a mesh of mixed tetrahedra give the same force without damage.
#[test]
fn layers_normal_to_the_load_have_the_force_of_a_reuss_mixture() {
    // the strain is small, because at finite strain the nominal stress depends on the stretch of each layer
    let strain = 1e-6;
    for order in [Order::Linear, Order::Quadratic] {
        let force = |mesh| last(&confined(mesh, order, phases(), None, strain).expect("valid")).0;
        let (followed, homogenised) = (force(layers()), force(mixed(0.5)));
        let close = (followed - homogenised).abs() < 1e-5 * followed;
        assert!(close, "{followed} and {homogenised}");
    }
}

/// A mixed tetrahedron consists of the matrix and the phase `mixture.region`; further regions of the mesh have no effect.
#[test]
fn a_mixture_has_the_moduli_of_its_second_phase() {
    let [matrix, grain] = phases();
    let field = Some(PhaseField::new(0.06));
    for (order, strain) in [(Order::Linear, 1e-6), (Order::Quadratic, 0.006)] {
        let two = confined(mixed(0.5), order, phases(), field, strain).expect("valid");
        let mut mesh = mixed(0.5);
        mesh.regions = vec!["matrix".into(), "other".into(), "grain".into()];
        mesh.mixture.as_mut().unwrap().iter_mut().for_each(|mixture| mixture.region = 2);
        let materials = [matrix.clone(), Material::hencky(1.0, 0.1), grain.clone()];
        let three = confined(mesh, order, materials, field, strain).expect("valid");
        let (two, three) = (last(&two), last(&three));
        assert_eq!((two.0, two.1.damage), (three.0, three.1.damage));
    }
}

/// Returns the smallest and the largest φ of the nodes whose height satisfies `height`.
fn damage_at(problem: &Problem, fields: &Fields, height: impl Fn(f64) -> bool) -> [f64; 2] {
    let nodes = problem.nodes().iter().zip(&fields.damage);
    let chosen = nodes.filter(|(x, _)| height(x[2])).map(|(_, &phi)| phi);
    chosen.fold([1.0, 0.0], |[low, high], phi| [phi.min(low), phi.max(high)])
}

/// The matrix of a mixed tetrahedron has the same strain, and so the same damage, as the matrix in a mesh of layers.
#[test]
fn damage_of_a_mixture_equals_the_damage_of_the_matrix_between_layers() {
    let strain = 0.006;
    let field = PhaseField::new(0.06);
    let matrix = |z: f64| z < 0.2501 || (0.4999..0.7501).contains(&z);
    for order in [Order::Linear, Order::Quadratic] {
        let problem = |mesh| confined(mesh, order, phases(), Some(field), strain).expect("valid");
        let followed = problem(layers());
        let (force, fields) = last(&followed);
        let (mixed_force, mixed_fields) = last(&problem(mixed(0.5)));
        let phi = mixed_fields.damage[0];
        assert!(phi > 0.02, "{phi}");
        // damage is equal at all nodes of the matrix, because it is not constrained at the nodes on the grain surface
        let [low, high] = damage_at(&followed, &fields, matrix);
        assert!(high - low < 1e-6 * high, "{low} to {high}");
        assert!((high - phi).abs() < 0.04 * phi, "{high} and {phi}");
        assert!((force - mixed_force).abs() < 0.02 * force, "{force} and {mixed_force}");
    }
}

/// Grains without toughness do not constrain the damage of the matrix at their surface; grains with a high toughness do.
#[test]
fn damage_at_the_surface_of_grains_is_free() {
    let field = PhaseField::new(0.06);
    let surface = |z: f64| (z - 0.25).abs() < 1e-3 || (z - 0.5).abs() < 1e-3;
    let surface_damage = |grain: Material| {
        let [matrix, _] = phases();
        let problem = confined(layers(), Order::Linear, [matrix, grain], Some(field), 0.006);
        let problem = problem.expect("valid");
        let (_, fields) = last(&problem);
        damage_at(&problem, &fields, surface)
    };
    let [least, _] = surface_damage(Material::hencky(22_000.0, 0.25));
    let [_, pinned] = surface_damage(crate::support::grain());
    assert!(least > 0.02 && pinned < 0.2 * least, "{least} and {pinned}");
}

#[test]
fn mixtures_with_too_much_grain_are_not_damaged() {
    let field = PhaseField::new(0.06);
    let problem = |fraction| {
        confined(mixed(fraction), Order::Linear, phases(), Some(field), 0.01).expect("valid")
    };
    let (little, much) = (problem(0.89), problem(0.91));
    assert!(little.unknowns() > much.unknowns());
    assert!(last(&much).1.damage.iter().all(|&phi| phi == 0.0));
    assert!(last(&little).1.damage.iter().all(|&phi| phi > 0.0));
}

#[test]
fn mixtures_need_two_phases_of_henckys_law() {
    let refused = |mesh: TetMesh, materials: Vec<Material>| {
        let problem =
            Problem::builder(mesh).materials(materials).schedule(Schedule::fixed(1.0, 1)).build();
        problem.expect_err("refused").to_string()
    };
    let [matrix, _] = phases();
    let message = refused(mixed(0.5), vec![matrix.clone(), Material::neo_hookean(22_000.0, 0.25)]);
    assert!(message.contains("Hencky"), "{message}");
    let mut one = mixed(0.5);
    one.regions.pop();
    let message = refused(one, vec![matrix]);
    assert!(message.contains("two"), "{message}");
}
