//! Warnings about inaccurate results: elements that lock, and parts that are joined only by an edge or a node.

use crate::support::block::{block, even};
use fem::{
    Axis, Conditions, End, Material, Order, Plasticity, Problem, ProblemWarning, Schedule, TetMesh,
};

fn held(mesh: TetMesh, order: Order, poisson: f64, surface: &str) -> Problem {
    Problem::builder(mesh)
        .order(order)
        .materials([Material::hencky(1.0, poisson)])
        .conditions(Conditions::new().fix(surface, Axis::ALL))
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid")
}

/// Returns the force on a rubber block with fixed ends, computed with linear elements, divided by the force computed with
/// quadratic elements.
fn volumetric(poisson: f64, cells: usize) -> f64 {
    let cells = even(0.0, 2.0, cells);
    let [linear, quadratic] = [Order::Linear, Order::Quadratic].map(|order| {
        let conditions = Conditions::new()
            .fix("bottom", Axis::ALL)
            .prescribe("top", Axis::ALL, |_, t| [0.0, 0.0, -0.02 * t])
            .measure("top", [0.0, 0.0, -1.0]);
        let problem = Problem::builder(block([&cells, &cells, &cells]))
            .order(order)
            .materials([Material::hencky(1.0, poisson)])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, 1))
            .build()
            .expect("valid");
        let outcome = problem.run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        outcome.curve[0].force_n
    });
    linear / quadratic
}

/// Returns the deflection of a cantilever computed with linear elements, divided by the deflection of beam theory.
fn bending(cells: [usize; 2], slenderness: f64) -> f64 {
    let (across, along) = (even(0.0, 1.0, cells[0]), even(0.0, slenderness, cells[1]));
    let mesh = block([&across, &across, &along]);
    let load = 1e-6;
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .traction("top", move |_, t| [load * t, 0.0, 0.0])
        .measure("top", [1.0, 0.0, 0.0]);
    let problem = Problem::builder(mesh)
        .materials([Material::hencky(1000.0, 0.0)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let exact = load * slenderness.powi(3) / (3.0 * 1000.0 / 12.0);
    outcome.curve[0].displacement_mm / exact
}

#[test]
fn linear_elements_that_lock_cause_a_warning() {
    let named = |mesh: TetMesh, order, poisson| held(mesh, order, poisson, "bottom").warnings();
    let cube = |n| {
        let cells = even(0.0, 2.0, n);
        block([&cells, &cells, &cells])
    };
    // without a warning, the error relative to quadratic elements is below one eighth; with a warning it is larger
    assert!(named(cube(6), Order::Linear, 0.44).is_empty() && volumetric(0.44, 6) < 1.125);
    let locks = named(cube(6), Order::Linear, 0.4999);
    assert!(matches!(&locks[..], [ProblemWarning::VolumetricLocking { .. }]), "{locks:?}");
    assert!(volumetric(0.499, 3) > 5.0);
    assert!(locks[0].to_string().contains("region 'matrix'"), "{}", locks[0]);
    assert!(named(cube(2), Order::Quadratic, 0.4999).is_empty());
    // a bar of slenderness 10 with n cubes across its thickness
    let bar = |n: usize| {
        let across = even(0.0, 1.0, n);
        block([&across, &across, &even(0.0, 10.0, 10 * n)])
    };
    for cells in [1, 4] {
        let stiff = named(bar(cells), Order::Linear, 0.0);
        assert!(
            matches!(&stiff[..], [ProblemWarning::BendingLocking { .. }]),
            "{cells}: {stiff:?}"
        );
    }
    assert!(bending([1, 10], 10.0) < 0.3 && bending([4, 40], 10.0) < 0.85);
    assert!(named(bar(10), Order::Linear, 0.0).is_empty());
    assert!(named(bar(1), Order::Quadratic, 0.0).is_empty());
}

/// `thick_sphere` and `limit_load` measure how linear elements lock in plastic flow.
#[test]
fn plastic_regions_of_linear_elements_cause_a_warning() {
    let warnings = |order, material: Material| {
        let cells = even(0.0, 2.0, 6);
        let problem = held(block([&cells, &cells, &cells]), order, 0.3, "bottom");
        problem.with_materials(vec![material]).expect("valid").warnings()
    };
    let elastic = Material::hencky(1000.0, 0.3);
    let plastic = elastic.clone().with_plasticity(Plasticity::new(1.0));
    let region = "matrix".to_owned();
    let locking = ProblemWarning::PlasticLocking { region };
    assert_eq!(warnings(Order::Linear, plastic.clone()), [locking]);
    assert_eq!(warnings(Order::Quadratic, plastic), []);
    assert_eq!(warnings(Order::Linear, elastic), []);
}

/// Mesh of two tetrahedra with `common` common nodes.
fn pair(common: u32) -> TetMesh {
    let mut mesh = TetMesh { regions: vec!["matrix".into()], ..TetMesh::default() };
    mesh.nodes = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    mesh.nodes.extend([[0.0, 0.0, -1.0], [0.0, -1.0, -0.2], [-1.0, 0.2, -0.2]]);
    let other = match common {
        3 => [0, 2, 1, 4],
        2 => [0, 1, 5, 4],
        _ => [0, 5, 6, 4],
    };
    mesh.tets = vec![[0, 1, 2, 3], other];
    let used: Vec<u32> = (0..7).filter(|n| mesh.tets.iter().flatten().any(|m| m == n)).collect();
    let number = |n: &u32| used.iter().position(|m| m == n).expect("used") as u32;
    mesh.tets = mesh.tets.iter().map(|tet| tet.each_ref().map(number)).collect();
    mesh.nodes = used.iter().map(|&n| mesh.nodes[n as usize]).collect();
    mesh.region_of = vec![0; 2];
    mesh.surfaces.insert("side".into(), vec![[1, 2, 3]]);
    mesh
}

#[test]
fn parts_joined_by_an_edge_or_a_node_cause_a_warning() {
    for (common, hinged) in [(3, false), (2, true), (1, true)] {
        let warnings = held(pair(common), Order::Quadratic, 0.3, "side").warnings();
        let hinge = ProblemWarning::Hinges { parts: 2, tet: 1 };
        assert_eq!(warnings, if hinged { vec![hinge] } else { vec![] }, "{common} common nodes");
    }
    let cells = even(0.0, 1.0, 2);
    let sound = block([&cells, &cells, &cells]);
    assert!(held(sound, Order::Quadratic, 0.3, "bottom").warnings().is_empty());
}
