//! Unilateral platens: Hertzian contact, lift-off, Coulomb friction, and agreement with sliding platens.

use crate::support::block::{block, even};
use crate::support::hertz::hertz;
use crate::support::{between, loading, matrix, phase_field, prism};
use fem::{
    Axis, Conditions, End, Friction, Material, Order, Platen, Platens, Problem, Schedule,
    SolverOptions,
};

fn steps(n: u32) -> Schedule {
    Schedule::fixed(1.0, n)
}

fn soft(young_mpa: f64, poisson: f64) -> Vec<Material> {
    vec![Material::hencky(young_mpa, poisson)]
}

#[test]
fn the_pressure_of_a_ball_agrees_with_hertz() {
    // three elements across the contact radius; the benchmark `contact` refines the mesh
    let result = hertz(3, Order::Linear);
    let off = |x: f64, exact: f64| (x / exact - 1.0).abs();
    assert!(off(result.radius_mm, result.exact_radius_mm) < 0.03, "{result:?}");
    assert!(off(result.pressure_mpa, result.exact_pressure_mpa) < 0.08, "{result:?}");
}

#[test]
fn a_tilted_platen_has_no_contact_where_the_pressure_would_be_negative() {
    // a thin layer with ν = 0 on a rigid base behaves like independent springs: p = E ⟨δ − θ x⟩ / h
    let (young, length, edge, depth) = (100.0, 60.0, 40.0, 2e-3);
    let mesh = block([&even(0.0, length, 90), &even(0.0, 1.0, 1), &even(0.0, 1.0, 2)]);
    let slope = depth / edge;
    // an inclined plane through (0, 0, 1 − δ) and (40, 0, 1) mm
    let platen = Platen::plane([edge, 0.0, 1.0 + depth], [slope, 0.0, -1.0])
        .moving(move |time_s| [0.0, 0.0, -depth * time_s]);
    let conditions = Conditions::new()
        .symmetry("front")
        .symmetry("back")
        .fix("bottom", Axis::ALL)
        .platen("top", platen)
        .measure("top", [0.0, 0.0, -1.0]);
    let options = SolverOptions::default();
    for order in [Order::Linear, Order::Quadratic] {
        let problem = Problem::builder(mesh.clone())
            .order(order)
            .materials(soft(young, 0.0))
            .conditions(conditions.clone())
            .schedule(steps(2))
            .options(options)
            .build()
            .expect("valid");
        let outcome = problem.run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let force = outcome.curve[1].force_n;
        let exact = young * depth * edge / 2.0;
        assert!((force / exact - 1.0).abs() < 0.03, "{order:?}: {force} instead of {exact} N");
        let contact_points = &outcome.contact["top"];
        let touching = contact_points.iter().filter(|p| p.pressure_mpa > 0.0);
        let reach = touching.map(|p| problem.nodes()[p.node as usize][0]).fold(0.0, f64::max);
        assert!((reach - edge).abs() < 1.5, "{order:?}: contact ends at {reach} mm");
        let total: f64 = contact_points.iter().map(|p| p.area_mm2 * p.pressure_mpa).sum();
        assert!((total / force - 1.0).abs() < 1e-5, "{order:?}: {total} against {force} N");
        for p in contact_points {
            assert!(p.pressure_mpa >= 0.0 && p.gap_mm > -1e-9, "{order:?}: {p:?}");
            assert!(p.pressure_mpa == 0.0 || p.gap_mm < 1e-9, "{order:?}: {p:?}");
        }
        let open = contact_points.iter().filter(|p| p.gap_mm > 1e-4).count();
        assert!(
            4 * open > contact_points.len(),
            "{order:?}: {open} of {} lifted off",
            contact_points.len()
        );
    }
}

/// Presses a block by 1 MPa and pulls it sideways. Returns the tangential and the normal force at the end, N, and three
/// values of the last step: the sliding distance, mm, the heat of friction, N mm, and the energy balance, N mm.
fn pulled(order: Order, friction: f64, slip_velocity: f64, drag: f64) -> (f64, f64, [f64; 3]) {
    let mesh = block([&even(0.0, 4.0, 3), &even(0.0, 4.0, 3), &even(0.0, 2.0, 2)]);
    let platen =
        Platen::plane([0.0; 3], [0.0, 0.0, 1.0]).friction(friction, slip_velocity).drag(drag);
    let conditions = Conditions::new()
        .platen("bottom", platen)
        .traction("top", |_, _| [0.0, 0.0, -1.0])
        .prescribe("right", [Axis::X], |_, time_s| [0.5 * time_s, 0.0, 0.0])
        .measure("right", [1.0, 0.0, 0.0]);
    let problem = Problem::builder(mesh)
        .order(order)
        .materials(soft(1000.0, 0.3))
        .conditions(conditions)
        .schedule(steps(10))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let [x, y, z] = outcome.reactions["bottom"][9];
    assert!(y.abs() < 1e-6, "{y}");
    let [last, before] = [9, 8].map(|k| &outcome.curve[k]);
    assert!((last.force_n + x).abs() < 1e-5 * last.force_n, "{last:?} {x}");
    assert!(outcome.curve.iter().all(|p| p.friction_n_mm > 0.0));
    let slid = last.displacement_mm - before.displacement_mm;
    (-x, z, [slid, last.friction_n_mm - before.friction_n_mm, last.balance_n_mm()])
}

#[test]
fn the_friction_force_of_a_sliding_block_is_mu_times_the_normal_force() {
    for order in [Order::Linear, Order::Quadratic] {
        let (slip, velocity) = (0.01, 0.5f64);
        let (tangential, normal, [slid, heat, _]) = pulled(order, 0.3, slip, 0.0);
        assert!((normal - 16.0).abs() < 1e-6, "{order:?}: N = {normal}");
        let exact = 0.3 * 16.0 * velocity / velocity.hypot(slip);
        assert!((tangential / exact - 1.0).abs() < 1e-5, "{order:?}: {tangential}, not {exact} N");
        // once the block slides, friction dissipates all work of the tangential force
        assert!((heat / (tangential * slid) - 1.0).abs() < 1e-4, "{order:?}: {heat} N mm");
    }
}

#[test]
fn drag_is_linear_in_the_velocity() {
    // the tangential force of viscous drag is T = F_v v A
    let (tangential, _, [slid, heat, balance]) = pulled(Order::Linear, 0.0, 1.0, 0.04);
    let exact = 0.04 * 0.5 * 16.0;
    assert!((tangential / exact - 1.0).abs() < 1e-6, "{tangential} instead of {exact} N");
    assert!((heat / (exact * slid) - 1.0).abs() < 1e-5, "{heat} N mm");
    // in the first step, the block accelerates from rest, therefore the balance is not zero
    assert!(balance.abs() < 0.1 * exact, "{balance} N mm");
}

#[test]
fn unilateral_platens_without_friction_give_the_force_of_sliding_platens() {
    for (order, field) in [
        (Order::Linear, None),
        (Order::Quadratic, None),
        (Order::Linear, Some(phase_field(fem::Split::None))),
    ] {
        let way = loading(0.1, 1.0, 4);
        let test =
            crate::support::test(prism(2, false), order, vec![matrix()], field, way.clone(), 1e-10);
        let sliding = test.run(&mut ());
        let free = between(&test, &way, Platens::Unilateral(Friction::none()));
        let unilateral = free.run(&mut ());
        assert!(matches!(unilateral.end, End::Displacement), "{:?}", unilateral.end);
        for (a, b) in sliding.curve.iter().zip(&unilateral.curve) {
            assert!((a.force_n / b.force_n - 1.0).abs() < 1e-6, "{order:?}: {a:?} {b:?}");
            assert!((a.work_n_mm / b.work_n_mm - 1.0).abs() < 1e-5, "{order:?}: {a:?} {b:?}");
        }
    }
}

#[test]
fn friction_stiffens_a_specimen_and_is_in_the_energy_balance() {
    let mesh =
        fem::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.2 }.build().unwrap();
    let way = loading(0.22, 1.0, 8);
    let test =
        crate::support::test(mesh, Order::Linear, soft(275.0, 0.25), None, way.clone(), 1e-9);
    let run = |friction: f64| {
        let friction = Friction {
            coefficient: friction,
            slip_velocity_mm_per_s: 1e-3,
            drag_mpa_s_per_mm: 0.01,
        };
        let outcome = between(&test, &way, Platens::Unilateral(friction)).run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        *outcome.curve.last().expect("a curve")
    };
    let (smooth, rough) = (run(0.0), run(0.3));
    assert!(rough.force_n > 1.02 * smooth.force_n, "{} {}", rough.force_n, smooth.force_n);
    for point in [smooth, rough] {
        // elastic energy and friction account for the work of the platens
        assert!(point.friction_n_mm > 0.0);
        assert!(point.balance_n_mm().abs() < 2e-3 * point.work_n_mm, "{point:?}");
    }
}

#[test]
fn platens_in_contact_with_stiff_grains_need_no_reduced_steps() {
    let mut mesh =
        fem::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.6 }.build().unwrap();
    let grains = fem::Packing::new(0.15, 3).fill(2.5, 4.4).expect("a packing");
    fem::label(&mut mesh, &grains);
    let solids = [275.0, 22_000.0].map(|young| Material::hencky(young, 0.25));
    let way = loading(0.05, 0.25, 2);
    let test = crate::support::test(mesh, Order::Linear, solids.to_vec(), None, way.clone(), 1e-8);
    let sliding = test.run(&mut ()).curve[1].force_n;
    let [smooth, rough] = [0.0, 0.2].map(|coefficient| {
        let friction =
            Friction { coefficient, slip_velocity_mm_per_s: 1e-3, drag_mpa_s_per_mm: 0.01 };
        let outcome = between(&test, &way, Platens::Unilateral(friction)).run(&mut ());
        assert_eq!(outcome.effort.cuts, 0, "{coefficient}: {:?}", outcome.end);
        outcome.curve[1].force_n
    });
    // unilateral platens give a smaller force than sliding platens, because the ends can lift off
    assert!(smooth < 1.001 * sliding && smooth > 0.8 * sliding, "{smooth} {sliding} N");
    assert!(rough > smooth, "{rough} {smooth} N");
}

#[test]
fn platens_with_invalid_parameters_are_rejected() {
    let refused = |platen: Platen, part: &str| {
        let mesh = block([&even(0.0, 1.0, 1), &even(0.0, 1.0, 1), &even(0.0, 1.0, 1)]);
        let conditions = Conditions::new().fix("bottom", Axis::ALL).platen("top", platen);
        let error = Problem::builder(mesh)
            .materials(soft(1.0, 0.3))
            .conditions(conditions)
            .schedule(steps(1))
            .build();
        let message = error.expect_err("refused").to_string();
        assert!(message.contains(part) && message.contains("surface 'top'"), "{message}");
    };
    let plane = || Platen::plane([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    refused(plane().friction(-0.1, 1.0), "friction = -0.1");
    refused(plane().friction(0.1, 0.0), "slip_velocity_mm_per_s = 0");
    refused(Platen::sphere([0.0; 3], -2.0), "radius_mm = -2");
    refused(Platen::plane([0.0, f64::NAN, 1.0], [0.0, 0.0, -1.0]), "point_mm = NaN");
    refused(Platen::sphere([0.0, 0.0, f64::INFINITY], 2.0), "centre_mm = inf");
    refused(plane().moving(|_| [0.0, 0.0, 1.0]), "travel_mm at time zero");
}
