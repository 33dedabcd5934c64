//! Forces on surfaces: loads, supports with common edges, and the balance of forces.

use crate::support::block::{block, even};
use fem::{
    Axis, Conditions, End, Material, Order, Outcome, Problem, Schedule, SolverOptions, TetMesh,
};

const ORDERS: [Order; 2] = [Order::Linear, Order::Quadratic];
const FACES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

/// Mesh of a block of 2 × 3 × 4 mm on a grid with varying spacing.
fn body() -> TetMesh {
    block([&[0.0, 0.5, 1.3, 2.0], &[0.0, 1.2, 3.0], &even(0.0, 4.0, 3)])
}

fn run(order: Order, conditions: Conditions) -> Outcome {
    let problem = Problem::builder(body())
        .order(order)
        .materials([Material::hencky(100.0, 0.3)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 2))
        .options(SolverOptions { tolerance: 1e-11, ..SolverOptions::default() })
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome
}

#[test]
fn the_force_on_a_loaded_surface_is_its_load() {
    // the fixed surface has a common edge with the loaded surface; its reaction must not be added to the loaded surface
    for order in ORDERS {
        let conditions = Conditions::new()
            .fix("left", Axis::ALL)
            .traction("top", |x, t| [0.1 * t, 0.0, -0.2 * t * (1.0 + x[0])])
            .measure("top", [0.0, 0.0, -1.0]);
        let outcome = run(order, conditions);
        // ∫ 0.2 (1 + x) dA over 2 × 3 mm = 0.2 · 12
        for (point, part) in outcome.curve.iter().zip([0.5, 1.0]) {
            let exact = 2.4 * part;
            assert!((point.force_n - exact).abs() < 1e-12, "{order:?}: {} N", point.force_n);
        }
        let [top, left] = ["top", "left"].map(|name| outcome.reactions[name][1]);
        assert!((top[0] - 0.6).abs() < 1e-12 && top[1].abs() < 1e-12, "{order:?}: {top:?}");
        for k in 0..3 {
            assert!((top[k] + left[k]).abs() < 1e-9, "{order:?}: {top:?} {left:?}");
        }
    }
}

#[test]
fn the_forces_of_surfaces_with_common_edges_add_up_to_the_force_on_the_body() {
    for order in ORDERS {
        // three faces with common edges and a common corner; two of them fix the same components
        let conditions = Conditions::new()
            .fix("left", Axis::ALL)
            .fix("bottom", Axis::ALL)
            .symmetry("front")
            .traction("right", |_, _| [0.3, 0.1, 0.0])
            .traction("top", |_, _| [0.0, 0.2, -0.4])
            .body_force(|_, _| [0.01, -0.02, 0.03]);
        let outcome = run(order, conditions);
        let volume = 24.0;
        for k in 0..3 {
            let forces = FACES.iter().filter_map(|face| outcome.reactions.get(*face));
            let sum: f64 = forces.map(|of| of[1][k]).sum();
            let body = [0.01, -0.02, 0.03][k] * volume;
            assert!((sum + body).abs() < 1e-9, "{order:?}: {sum} N and {body} N along {k}");
        }
        // the force of a plane of symmetry is normal to the plane
        let [x, y, z] = outcome.reactions["front"][1];
        assert!(x == 0.0 && z == 0.0 && y.abs() > 0.01, "{order:?}: {x} {y} {z}");
    }
}

#[test]
fn fixed_faces_share_the_forces_of_their_common_edges() {
    // uniform strain, prescribed on all faces: the force on each face is P n A, where adjacent faces share the force
    // of their common edge
    let strain = [-0.01, 0.004, 0.002];
    let affine = move |x: [f64; 3], t: f64| std::array::from_fn(|k| t * strain[k] * x[k]);
    for order in ORDERS {
        let conditions =
            FACES.iter().fold(Conditions::new(), |c, face| c.prescribe(face, Axis::ALL, affine));
        let outcome = run(order, conditions);
        // nominal stresses of Hencky's law, P_i = (λ tr ε + 2μ ε_i)/(1 + strain_i)
        let log = strain.map(|e: f64| e.ln_1p());
        let (lame, shear) = (100.0 * 0.3 / (1.3 * 0.4), 100.0 / 2.6);
        let sides = [2.0, 3.0, 4.0];
        for (k, faces) in
            [["left", "right"], ["front", "back"], ["bottom", "top"]].iter().enumerate()
        {
            let stress =
                (lame * log.iter().sum::<f64>() + 2.0 * shear * log[k]) / (1.0 + strain[k]);
            let exact = stress * sides[(k + 1) % 3] * sides[(k + 2) % 3];
            let [low, high] = faces.map(|face| outcome.reactions[face][1]);
            let total: f64 = FACES.iter().map(|face| outcome.reactions[*face][1][k]).sum();
            assert!(total.abs() < 1e-9 * exact.abs(), "{order:?}: {total} N along {k}");
            assert!((low[k] + high[k]).abs() < 0.2 * exact.abs(), "{order:?}: {low:?} {high:?}");
            // the force is smaller than P n A, because adjacent faces carry a part of the force of the common edges
            assert!(
                high[k] / exact > 0.4 && high[k] / exact < 1.0,
                "{order:?}: {} of {exact} N",
                high[k]
            );
        }
    }
}
