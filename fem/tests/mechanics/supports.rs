//! Supports of nodes and edges, extensometers, and the forces, torques, stresses and energies of given fields.

use crate::support::block::{block, even};
use fem::element::{DamageRule, Domain, Quadratic, Space};
use fem::{
    Axis, Conditions, CylinderLattice, End, FemError, Grain, GrainList, GrainMode, Material,
    Meshing, NodeSet, Order, Outcome, Problem, ProblemBuilder, Schedule, SolverOptions,
    Unsupported,
};

const ORDERS: [Order; 2] = [Order::Linear, Order::Quadratic];

/// Builder of a problem on a block of 2 × 3 × 4 mm with varying grid spacing, with one load step.
fn builder(order: Order) -> ProblemBuilder {
    let mesh = block([&[0.0, 0.5, 1.3, 2.0], &[0.0, 1.2, 3.0], &even(0.0, 4.0, 3)]);
    Problem::builder(mesh)
        .order(order)
        .materials([Material::hencky(100.0, 0.3)])
        .schedule(Schedule::fixed(1.0, 1))
        .options(SolverOptions { tolerance: 1e-11, ..SolverOptions::default() })
}

fn run(problem: &Problem) -> Outcome {
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome
}

#[test]
fn a_pin_and_an_edge_support_a_bar_without_force() {
    for order in ORDERS {
        // the bottom slides on a plane, the origin is fixed, and the edge y = z = 0 cannot rotate
        let edges = [
            NodeSet::segment([0.0; 3], [2.0, 0.0, 0.0]),
            NodeSet::common("bottom", "front"),
            NodeSet::matching(|[_, y, z]| y == 0.0 && z == 0.0),
        ];
        for edge in edges {
            let conditions = Conditions::new()
                .node_set("pin", NodeSet::nearest([-0.1, 0.0, 0.1]))
                .node_set("edge", edge)
                .fix("bottom", [Axis::Z])
                .fix("pin", [Axis::X, Axis::Y])
                .fix("edge", [Axis::Y])
                .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.04 * time_s])
                .measure("top", [0.0, 0.0, 1.0]);
            let problem = builder(order).conditions(conditions).build().expect("valid");
            let outcome = run(&problem);
            // lateral stretch λ_x = λ^−ν about the origin, for the axial stretch λ = 1.01
            let across = 1.01f64.powf(-0.3) - 1.0;
            for (x, u) in problem.nodes().iter().zip(&outcome.fields.displacement) {
                let exact = [across * x[0], across * x[1], 0.01 * x[2]];
                for k in 0..3 {
                    assert!((u[k] - exact[k]).abs() < 1e-9, "{order:?} at {x:?}: {u:?}");
                }
            }
            for name in ["pin", "edge"] {
                let force = outcome.reactions[name][0];
                assert!(force.iter().all(|f| f.abs() < 1e-7), "{order:?}, {name}: {force:?} N");
            }
        }
    }
}

#[test]
fn two_line_supports_carry_a_load_by_statics() {
    for order in ORDERS {
        // a load of 0.006 N on the top, at x = 1 mm; supports along lines at x = 0 and x = 1.3 mm. The balance of moments
        // about the line at x = 0 gives the force 0.006 N · 1/1.3 on the other line
        let line = |x: f64| NodeSet::segment([x, 0.0, 0.0], [x, 3.0, 0.0]);
        let conditions = Conditions::new()
            .node_set("left line", line(0.0))
            .node_set("right line", line(1.3))
            .node_set("corner", NodeSet::nearest([0.0; 3]))
            .node_set("end", NodeSet::nearest([0.0, 3.0, 0.0]))
            .fix("left line", [Axis::Z])
            .fix("right line", [Axis::Z])
            .fix("corner", [Axis::X, Axis::Y])
            .fix("end", [Axis::X])
            .traction("top", |_, time_s| [0.0, 0.0, -0.001 * time_s]);
        let problem = builder(order).conditions(conditions).build().expect("valid");
        let outcome = run(&problem);
        let [left, right] = ["left line", "right line"].map(|name| outcome.reactions[name][0][2]);
        // the tolerance is large because the load moves with the body, which changes the lever arm by a fraction of
        // about 1e-4
        assert!((left + right - 0.006).abs() < 1e-10, "{order:?}: {left} + {right} N");
        assert!((right - 0.006 / 1.3).abs() < 1e-3 * 0.006, "{order:?}: {right} N");
        let state = problem.evaluate(&outcome.fields).expect("the fields of the problem");
        let again = state.force_n("right line").expect("a node set")[2];
        assert!((again - right).abs() < 1e-10, "{order:?}: {again} and {right} N");
        // the supports balance the moment of the load about the line at x = 0, with a lever arm of 1 mm
        let axis = [0.0, -1.0, 0.0];
        let torque = |name| state.torque_n_mm(name, [0.0; 3], axis).expect("a surface");
        assert!((torque("right line") - 0.006).abs() < 1e-5, "{order:?}: {}", torque("right line"));
        let sum = torque("right line") + torque("left line") + torque("top");
        assert!(sum.abs() < 1e-9, "{order:?}: {sum} N mm");
    }
}

#[test]
fn an_extensometer_measures_between_points_that_are_not_nodes() {
    for order in ORDERS {
        let gauge = [[0.31, 1.07, 0.83], [0.97, 0.41, 3.19]];
        let conditions = Conditions::new()
            .symmetry("left")
            .symmetry("front")
            .fix("bottom", [Axis::Z])
            .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.04 * time_s]);
        let along = |direction: [f64; 3]| {
            let conditions = conditions.clone().measure_between("top", direction, gauge);
            let problem = builder(order).conditions(conditions).build().expect("valid");
            run(&problem).curve[0]
        };
        let axial = along([0.0, 0.0, 2.0]);
        assert!((axial.displacement_mm - 0.01 * (3.19 - 0.83)).abs() < 1e-10, "{axial:?}");
        // F = A₀ E ln λ / λ
        let exact = 6.0 * 100.0 * 1.01f64.ln() / 1.01;
        assert!((axial.force_n - exact).abs() < 1e-7, "{axial:?}");
        let across = 1.01f64.powf(-0.3) - 1.0;
        let lateral = along([1.0, 0.0, 0.0]).displacement_mm;
        assert!((lateral - across * (0.97 - 0.31)).abs() < 1e-10, "{order:?}: {lateral} mm");
    }
}

#[test]
fn points_in_curved_elements_are_located_by_the_shape_functions() {
    let grains = GrainList::new(vec![Grain::sphere([0.0, 0.0, 2.2], 1.2)], 2.5, 4.4);
    let meshing = Meshing { mode: GrainMode::Conforming, ..Meshing::new(0.8) };
    let mesh = meshing.build(2.5, 4.4, &grains).expect("valid").mesh;
    assert!(!mesh.edge_points.is_empty(), "no curved edges");
    let space = Space::new::<Quadratic>(&mesh, DamageRule::Absent);
    for k in 1..=40 {
        // take points in the cylinder, some of them in elements at the curved surface of the ball
        let along = |multiple: f64| (f64::from(k) * multiple).fract();
        let (radius, angle) = (
            if k % 2 == 0 { 1.2 } else { 2.3 * along(0.755) },
            std::f64::consts::TAU * along(0.57),
        );
        let height = if k % 2 == 0 { 2.2 } else { 0.1 + 4.2 * along(0.43) };
        let x = [radius * angle.cos(), radius * angle.sin(), height];
        let at = space.interpolation(x).expect("a point of the body");
        for i in 0..3 {
            let sum: f64 = at.iter().map(|(n, value)| value * space.nodes[*n as usize][i]).sum();
            assert!((sum - x[i]).abs() < 1e-9, "{x:?}: {sum} mm");
        }
    }
    assert!(space.interpolation([2.6, 0.0, 2.2]).is_none());
}

#[test]
fn a_twisted_bar_has_the_torque_of_its_polar_moment() {
    // the torque T = G θ' ∫ r² dA of a round bar is exact for small angles
    let (height_mm, angle) = (4.4, 1e-3);
    let mesh =
        CylinderLattice { radius_mm: 2.5, height_mm, spacing_mm: 0.8 }.build().expect("valid");
    let turn = move |[x, y, _]: [f64; 3], time_s: f64| {
        let (sin, cos) = (angle * time_s).sin_cos();
        [cos * x - sin * y - x, sin * x + cos * y - y, 0.0]
    };
    let problem = Problem::builder(mesh)
        .order(Order::Quadratic)
        .materials([Material::hencky(100.0, 0.25)])
        .conditions(Conditions::new().fix("bottom", Axis::ALL).prescribe("top", Axis::ALL, turn))
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid");
    let outcome = run(&problem);
    let state = problem.evaluate(&outcome.fields).expect("the fields of the problem");
    let torque = |name| state.torque_n_mm(name, [0.0; 3], [0.0, 0.0, 3.0]).expect("a surface");
    let polar = state.integral(|p| p.position_mm[0].powi(2) + p.position_mm[1].powi(2)) / height_mm;
    let exact = 40.0 * angle / height_mm * polar;
    assert!((torque("top") / exact - 1.0).abs() < 0.003, "{} N mm, {exact}", torque("top"));
    assert!((torque("top") + torque("bottom")).abs() < 1e-5 * exact, "{}", torque("bottom"));
    // the energy equals the work of the torque, ½ T θ
    let energy = state.energy_n_mm().expect("an equilibrium");
    assert!((energy / (0.5 * torque("top") * angle) - 1.0).abs() < 1e-4, "{energy} N mm");
    let density = state.elements().expect("an equilibrium");
    let volumes = (0..density.len()).map(|tet| problem.mesh().tet_volume(tet));
    let sum: f64 = density.iter().zip(volumes).map(|(e, v)| e.energy_density_mpa * v).sum();
    assert!((sum / energy - 1.0).abs() < 1e-9, "{sum} and {energy} N mm");
}

#[test]
fn invalid_selections_and_fields_are_rejected() {
    let refused = |conditions: Conditions| {
        let pulled = conditions.remove_rigid_motions();
        match builder(Order::Linear).conditions(pulled).build().expect_err("refused") {
            FemError::Unsupported { reason, .. } => reason,
            other => panic!("{other}"),
        }
    };
    let nowhere = NodeSet::matching(|_| false);
    assert_eq!(
        refused(Conditions::new().node_set("pin", nowhere).fix("pin", [Axis::X])),
        Unsupported::EmptyNodeSet
    );
    let pin = NodeSet::nearest([0.0; 3]);
    assert_eq!(
        refused(Conditions::new().node_set("top", pin.clone()).fix("top", [Axis::X])),
        Unsupported::NameOfSurface
    );
    for (set, part) in [
        (NodeSet::nearest([0.0, f64::NAN, 0.0]), "node set 'pin': nearest = NaN"),
        (NodeSet::segment([0.0; 3], [f64::INFINITY, 0.0, 0.0]), "node set 'pin': segment = inf"),
    ] {
        let conditions = Conditions::new().node_set("pin", set).fix("pin", [Axis::X]);
        let pulled = conditions.remove_rigid_motions();
        let error = builder(Order::Linear).conditions(pulled).build().expect_err("refused");
        assert!(matches!(error, FemError::OutOfRange { .. }), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
    let outside = [[0.5, 0.5, 1.0], [0.5, 0.5, 4.1]];
    assert_eq!(
        refused(Conditions::new().measure_between("top", [0.0, 0.0, 1.0], outside)),
        Unsupported::GaugeOutside(outside[1])
    );
    let loaded = Conditions::new().node_set("pin", pin).traction("pin", |_, _| [0.0; 3]);
    let error = builder(Order::Linear).conditions(loaded).build().expect_err("no area");
    assert!(matches!(error, FemError::MissingSurface { .. }), "{error}");

    let problem = |order| {
        let conditions = Conditions::new().fix("bottom", Axis::ALL);
        builder(order).conditions(conditions).build().expect("valid")
    };
    let fields = run(&problem(Order::Linear)).fields;
    let other = problem(Order::Quadratic);
    assert!(matches!(other.evaluate(&fields), Err(FemError::OtherFields { nodes: 48, .. })));
    assert!(matches!(other.integrate(&fields, |_| 1.0), Err(FemError::OtherFields { .. })));
    let linear = problem(Order::Linear);
    let mut turned = fields;
    for (u, x) in turned.displacement.iter_mut().zip(linear.nodes()) {
        *u = [-2.0 * x[0], 0.0, 0.0];
    }
    let state = linear.evaluate(&turned).expect("as many nodes");
    assert!(matches!(state.elements(), Err(FemError::InvertedFields)));
    assert!(matches!(state.force_n("top"), Err(FemError::InvertedFields)));
    let error = state.torque_n_mm("top", [0.0; 3], [0.0; 3]).expect_err("an axis without length");
    assert!(matches!(error, FemError::OutOfRange { .. }), "{error}");
    let error = state.torque_n_mm("top", [f64::NAN; 3], [1.0; 3]).expect_err("no position");
    assert!(matches!(error, FemError::OutOfRange { .. }), "{error}");
    assert!(matches!(state.force_n("side"), Err(FemError::MissingSurface { .. })));
}
