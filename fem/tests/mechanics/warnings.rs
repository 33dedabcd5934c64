//! What spoils a result without an error: elements that lock, parts that hang together by an edge.

use crate::support::block::{block, even};
use fem::{Axis, Conditions, End, Material, Order, Problem, ProblemWarning, Schedule, TetMesh};

fn held(mesh: TetMesh, order: Order, poisson: f64, surface: &str) -> Problem {
    Problem::builder(mesh)
        .order(order)
        .materials([Material::hencky(1.0, poisson)])
        .conditions(Conditions::new().fix(surface, Axis::ALL))
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid")
}

/// A rubber block between glued plates: its force by linear elements over that by quadratic ones.
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

/// A bar on one end, its deflection by linear elements over that of beam theory.
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
fn linear_elements_that_lock_are_named() {
    let named = |mesh: TetMesh, order, poisson| held(mesh, order, poisson, "bottom").warnings();
    let cube = |n| {
        let cells = even(0.0, 2.0, n);
        block([&cells, &cells, &cells])
    };
    // what is not named is within an eighth of quadratic elements, and what is named is not
    assert!(named(cube(6), Order::Linear, 0.44).is_empty() && volumetric(0.44, 6) < 1.125);
    let locks = named(cube(6), Order::Linear, 0.4999);
    assert!(matches!(&locks[..], [ProblemWarning::VolumetricLocking { .. }]), "{locks:?}");
    assert!(volumetric(0.499, 3) > 5.0);
    assert!(locks[0].to_string().contains("region 'matrix'"), "{}", locks[0]);
    assert!(named(cube(2), Order::Quadratic, 0.4999).is_empty());
    // a bar of 10 : 1, by its cubes across
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

/// Two tetrahedra with so many nodes in common.
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
fn parts_that_hang_together_by_an_edge_or_a_node_are_named() {
    for (common, hinged) in [(3, false), (2, true), (1, true)] {
        let warnings = held(pair(common), Order::Quadratic, 0.3, "side").warnings();
        let hinge = ProblemWarning::Hinges { parts: 2, tet: 1 };
        assert_eq!(warnings, if hinged { vec![hinge] } else { vec![] }, "{common} nodes in common");
    }
    let cells = even(0.0, 1.0, 2);
    let sound = block([&cells, &cells, &cells]);
    assert!(held(sound, Order::Quadratic, 0.3, "bottom").warnings().is_empty());
}
