//! Boundary conditions: patch test, tractions, body force, symmetry, reactions, and errors of invalid conditions.

use crate::support::{HEIGHT, prism};
use fem::{
    Axis, Conditions, End, FemError, Material, Order, Outcome, Problem, Schedule, SolverOptions,
    TetMesh,
};

const ORDERS: [Order; 2] = [Order::Linear, Order::Quadratic];

/// Mesh of a prism; each of its six faces is a named surface.
fn block(n: usize) -> TetMesh {
    let mut mesh = prism(n, false);
    let side = mesh.nodes.iter().map(|x| x[0]).fold(0.0, f64::max);
    mesh.surfaces.clear();
    for face in mesh.boundary_faces() {
        let on = |axis: usize, value: f64| {
            face.iter().all(|&n| (mesh.nodes[n as usize][axis] - value).abs() < 1e-9)
        };
        let planes = [
            ("left", on(0, 0.0)),
            ("right", on(0, side)),
            ("front", on(1, 0.0)),
            ("back", on(1, side)),
            ("bottom", on(2, 0.0)),
            ("top", on(2, HEIGHT)),
        ];
        let name = planes.iter().find(|(_, on)| *on).expect("a plane").0;
        mesh.surfaces.entry(name.into()).or_default().push(face);
    }
    mesh
}

const FACES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

fn rubber() -> Vec<Material> {
    vec![Material::hencky(10.0, 0.3)]
}

fn steps(n: u32) -> Schedule {
    Schedule::fixed(1.0, n)
}

fn problem(
    mesh: TetMesh,
    order: Order,
    conditions: Conditions,
    n: u32,
) -> Result<Problem, FemError> {
    let options = SolverOptions { tolerance: 1e-12, ..SolverOptions::default() };
    Problem::builder(mesh)
        .order(order)
        .materials(rubber())
        .conditions(conditions)
        .schedule(steps(n))
        .options(options)
        .build()
}

fn run(problem: &Problem) -> Outcome {
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome
}

#[test]
fn affine_patch_on_an_unstructured_mesh() {
    let affine = |x: [f64; 3], t: f64| {
        let h = [[-0.08, 0.05, 0.02], [0.1, 0.07, -0.03], [-0.04, 0.06, -0.12]];
        std::array::from_fn::<f64, 3, _>(|i| {
            t * (0.01 + (0..3).map(|j| h[i][j] * x[j]).sum::<f64>())
        })
    };
    for order in ORDERS {
        let conditions =
            FACES.iter().fold(Conditions::new(), |c, face| c.prescribe(face, Axis::ALL, affine));
        let problem = problem(block(3), order, conditions, 4).expect("valid");
        let outcome = run(&problem);
        for (u, &x) in outcome.fields.displacement.iter().zip(problem.nodes()) {
            for (u, exact) in u.iter().zip(affine(x, 1.0)) {
                assert!((u - exact).abs() < 1e-10, "{order:?}: {u} instead of {exact} at {x:?}");
            }
        }
        // the displacement is prescribed on all faces: the reactions are in equilibrium, and their work equals the
        // energy up to the error of the trapezoid rule
        let point = outcome.curve.last().expect("a curve");
        assert!((point.work_n_mm / point.elastic_n_mm - 1.0).abs() < 0.02, "{point:?}");
    }
}

#[test]
fn a_traction_gives_the_stretch_of_the_closed_form() {
    // under a dead load, the nominal stress is P = E ln λ / λ, which both element orders reproduce exactly
    for order in ORDERS {
        let conditions = Conditions::new()
            .symmetry("left")
            .symmetry("front")
            .symmetry("bottom")
            .traction("top", |_, t| [0.0, 0.0, -t])
            .measure("top", [0.0, 0.0, -1.0]);
        let outcome = run(&problem(block(2), order, conditions, 2).expect("valid"));
        let stretch = 1.0 - outcome.curve[1].displacement_mm / HEIGHT;
        let stress = -10.0 * stretch.ln() / stretch;
        assert!((stress - 1.0).abs() < 1e-9, "{order:?}: {stress} MPa");
        // the force on the loaded face is the load; the reaction on the opposite face has the same
        // size
        let area = 2.5f64.powi(2) * std::f64::consts::PI;
        let bottom = outcome.reactions["bottom"][1];
        assert!((bottom[2] - area).abs() < 1e-8 * area, "{bottom:?}");
        assert!((outcome.curve[1].force_n - area).abs() < 1e-8 * area, "{:?}", outcome.curve[1]);
    }
}

#[test]
fn a_column_under_its_own_weight_has_the_displacement_of_the_closed_form() {
    // for ν = 0, P(z) = −ρ g (H − z) = E ln λ / λ at each height, and u_z(H) = ∫ (λ − 1) dz
    let weight = 0.2;
    let material = vec![Material::hencky(10.0, 0.0)];
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("front")
        .fix("bottom", [Axis::Z])
        .body_force(move |_, t| [0.0, 0.0, -weight * t])
        .measure("top", [0.0, 0.0, -1.0]);
    let problem = Problem::builder(block(3))
        .order(Order::Quadratic)
        .materials(material)
        .conditions(conditions)
        .schedule(steps(1))
        .build();
    let outcome = run(&problem.expect("valid"));
    let stretch = |stress: f64| {
        (0..60).fold(1.0f64, |l, _| {
            l - (10.0 * l.ln() / l + stress) / (10.0 * (1.0 - l.ln()) / (l * l))
        })
    };
    let n = 2000;
    let settled: f64 =
        (0..n).map(|k| 1.0 - stretch(weight * HEIGHT * (k as f64 + 0.5) / n as f64)).sum::<f64>()
            * HEIGHT
            / n as f64;
    let displacement_mm = outcome.curve[0].displacement_mm;
    assert!(
        (displacement_mm / settled - 1.0).abs() < 1e-3,
        "{displacement_mm} instead of {settled} mm"
    );
    let area = 2.5f64.powi(2) * std::f64::consts::PI;
    let carried = outcome.reactions["bottom"][0][2];
    assert!((carried / (area * HEIGHT * weight) - 1.0).abs() < 1e-8, "{carried} N");
}

#[test]
fn supports_against_rigid_motions_carry_no_force() {
    let stretch = |_: [f64; 3], t: f64| [0.3 * t, 0.0, 0.0];
    let conditions = Conditions::new()
        .fix("left", [Axis::X])
        .prescribe("right", [Axis::X], stretch)
        .remove_rigid_motions()
        .measure("right", [1.0, 0.0, 0.0]);
    let outcome = run(&problem(block(2), Order::Linear, conditions, 1).expect("valid"));
    let side = 2.5 * std::f64::consts::PI.sqrt();
    let stretch: f64 = 1.0 + 0.3 / side;
    let exact = side * HEIGHT * 10.0 * stretch.ln() / stretch;
    assert!((outcome.curve[0].force_n / exact - 1.0).abs() < 1e-9, "{}", outcome.curve[0].force_n);
    let [left, right] = ["left", "right"].map(|name| outcome.reactions[name][0]);
    for k in 0..3 {
        assert!((left[k] + right[k]).abs() < 1e-8 * exact, "{left:?} {right:?}");
    }
}

#[test]
fn invalid_conditions_are_rejected() {
    let refused = |conditions: Conditions, fragments: &[&str]| {
        let message =
            problem(block(2), Order::Linear, conditions, 1).expect_err("refused").to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "'{fragment}' is not in: {message}");
        }
    };
    let held = || Conditions::new().fix("bottom", Axis::ALL);
    refused(
        held().traction("lid", |_, _| [0.0; 3]),
        &["'lid'", "a traction acts", "'top'", "name the surfaces"],
    );
    refused(
        held().prescribe("left", [Axis::X], |_, t| [t, 0.0, 0.0]),
        &["'bottom' and 'left'", "common node", "u_x"],
    );
    refused(
        Conditions::new().symmetry("left").fix("bottom", [Axis::Z]),
        &["can still move along y", "remove_rigid_motions"],
    );
    refused(Conditions::new().symmetry("bottom"), &["(3 rigid motions are free)"]);
    refused(Conditions::new(), &["(6 rigid motions are free)"]);
    refused(held().measure("top", [0.0; 3]), &["'top'", "length of the direction = 0"]);
    let mut oblique = block(2);
    let all: Vec<_> = oblique.surfaces.values().flatten().copied().collect();
    oblique.surfaces.clear();
    oblique.surfaces.insert("all".into(), all);
    let error = problem(oblique, Order::Linear, Conditions::new().symmetry("all"), 1);
    let message = error.expect_err("refused").to_string();
    assert!(message.contains("surface 'all'") && message.contains("symmetry"), "{message}");
}
