//! J-integral: closed forms of cracks in elastic bodies, independence of the domain, and the balance with the resistance
//! of a phase field.

use crate::support::block::{block, even, graded};
use crate::support::matrix;
use fem::{
    Axis, Conditions, CrackDensity, CrackExtension, FemError, Fracture, Irreversibility, Material,
    NodeSet, Order, PhaseField, Problem, PronyTerm, Schedule, TetMesh, Unsupported,
    Viscoelasticity,
};

const YOUNG: f64 = 70_000.0;
const POISSON: f64 = 0.22;
/// Thickness of the slices in plane strain, mm.
const THICKNESS: f64 = 0.1;

/// Coordinates from `from` to `to` with spacing `h` at distances below `fine` from `centre`; beyond, the spacing grows.
fn around(centre: f64, [from, to]: [f64; 2], h: f64, fine: usize) -> Vec<f64> {
    let below = graded(h, fine, 1.3, centre - from);
    let above = graded(h, fine, 1.3, to - centre);
    let mut coordinates: Vec<f64> = below.iter().skip(1).rev().map(|d| centre - d).collect();
    coordinates.extend(above.iter().map(|d| centre + d));
    coordinates
}

/// Upper half of a plate in the x–z plane; the crack lies on z = 0 for x below `tip`.
fn upper_half(width: f64, height: f64, tip: f64, h: f64, fine: usize) -> TetMesh {
    let along = around(tip, [0.0, width], h, fine);
    block([&along, &[0.0, THICKNESS], &graded(h, fine, 1.3, height)])
}

/// Plane strain with free motion on the crack, and symmetry ahead of it.
fn plane_strain(tip: f64) -> Conditions {
    Conditions::new()
        .node_set("ligament", NodeSet::matching(move |[x, _, z]| x > tip - 1e-9 && z < 1e-9))
        .fix("ligament", [Axis::Z])
        .fix("front", [Axis::Y])
        .fix("back", [Axis::Y])
}

fn extension(tip: f64, radii_mm: [f64; 2]) -> CrackExtension {
    CrackExtension {
        tip_mm: [tip, 0.0, 0.0],
        front: [0.0, 1.0, 0.0],
        growth: [1.0, 0.0, 0.0],
        radii_mm,
    }
}

/// Energy release rates (N/mm) of a half model after one elastic step, for several domains.
fn released(
    mesh: TetMesh,
    order: Order,
    conditions: Conditions,
    tip: f64,
    radii: &[[f64; 2]],
) -> Vec<f64> {
    let problem = Problem::builder(mesh)
        .order(order)
        .materials([Material::hencky(YOUNG, POISSON)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    let state = problem.evaluate(&outcome.fields).expect("own fields");
    let rate = |&radii_mm: &[f64; 2]| {
        let q = extension(tip, radii_mm);
        2.0 * state.energy_release_n(|x| q.at(x)).expect("elastic") / THICKNESS
    };
    radii.iter().map(rate).collect()
}

/// A plate with an edge crack of 3/10 of its width under tension. K from Tada, Paris & Irwin (2000), exact within 0.5 %.
#[test]
fn edge_crack_has_the_stress_intensity_of_the_handbook() {
    let (width, height, tip, stress): (f64, f64, f64, f64) = (10.0, 15.0, 3.0, 10.0);
    let x = tip / width;
    let shape = 1.12 - 0.231 * x + 10.55 * x.powi(2) - 21.72 * x.powi(3) + 30.39 * x.powi(4);
    let intensity = stress * (std::f64::consts::PI * tip).sqrt() * shape;
    let exact = intensity.powi(2) * (1.0 - POISSON * POISSON) / YOUNG;
    for (order, h, tolerance) in [(Order::Linear, 0.025, 0.04), (Order::Quadratic, 0.1, 0.015)] {
        let conditions = plane_strain(tip)
            .traction("top", move |_, time_s| [0.0, 0.0, stress * time_s])
            .node_set("corner", NodeSet::matching(move |[x, ..]| (x - width).abs() < 1e-9))
            .node_set("pin", NodeSet::segment([width, 0.0, 0.0], [width, THICKNESS, 0.0]))
            .fix("pin", [Axis::X]);
        let mesh = upper_half(width, height, tip, h, 8);
        let radii = [[0.3, 1.0], [1.0, 2.5]];
        let rates = released(mesh, order, conditions, tip, &radii);
        for rate in &rates {
            assert!((rate - exact).abs() < tolerance * exact, "{order:?}: {rates:?}, {exact} N/mm");
        }
        let spread = (rates[0] - rates[1]).abs();
        assert!(spread < 0.004 * exact, "{order:?}: depends on the domain: {rates:?}");
    }
}

/// A clamped strip at a strain of 20 %: the energy release rate is the height times the energy density far ahead of the
/// crack, also at finite strain (Rivlin & Thomas 1953).
#[test]
fn clamped_strip_at_finite_strain_releases_its_energy() {
    let (width, height, tip): (f64, f64, f64) = (20.0, 2.0, 9.0);
    let opening = 0.2 * height;
    let modulus = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let exact = 2.0 * height * 0.5 * modulus * 1.2f64.ln().powi(2);
    let conditions = plane_strain(tip)
        .prescribe("top", [Axis::X, Axis::Z], move |_, time_s| [0.0, 0.0, opening * time_s]);
    let mesh = upper_half(width, height, tip, 0.1, 6);
    let rates = released(mesh, Order::Quadratic, conditions, tip, &[[0.3, 1.0], [0.8, 1.8]]);
    for rate in &rates {
        assert!((rate - exact).abs() < 0.01 * exact, "{rates:?}, {exact} N/mm");
    }
}

/// A crack that grows stably with a viscous phase field: the elastic energy that it releases is the crack energy plus the
/// viscous dissipation.
#[test]
fn release_of_a_growing_crack_balances_crack_energy_and_viscosity() {
    const LENGTH: f64 = 0.3;
    const TOUGHNESS: f64 = 0.01;
    let (width, height, tip) = (14.0, 4.0, 5.0);
    let along = around(tip, [0.0, width], 0.1, 36);
    let mut across = graded(0.1, 6, 1.4, height - 0.05);
    across.iter_mut().for_each(|z| *z += 0.05);
    across.insert(0, 0.0);
    let mesh = block([&along, &[0.0, THICKNESS], &across]);
    let opening =
        |time_s: f64| if time_s < 1.0 { 0.0012 * time_s } else { 0.00115 + 5e-5 * time_s };
    let conditions = plane_strain(tip)
        .node_set("crack", NodeSet::matching(move |[x, _, z]| x < tip + 1e-9 && z < 0.051))
        .prescribe_damage("crack", |_, _| 1.0)
        .prescribe("top", [Axis::X, Axis::Z], move |[x, ..], time_s| {
            [0.0, 0.0, opening(time_s) * (1.0 - x / width)]
        });
    let fracture = Fracture {
        toughness_n_per_mm: TOUGHNESS,
        viscosity_mpa_s: 0.006,
        residual_stiffness: 1e-4,
    };
    let problem = Problem::builder(mesh)
        .materials([Material::hencky(YOUNG, POISSON).with_fracture(fracture)])
        .phase_field(PhaseField {
            model: CrackDensity::At2,
            irreversibility: Irreversibility::None,
            ..PhaseField::new(LENGTH)
        })
        .conditions(conditions)
        .schedule(Schedule::fixed(8.0, 8))
        .build()
        .expect("valid");
    let q = |[x, _, z]: [f64; 3]| {
        let ramp = |distance: f64, room: f64| (1.0 - distance / room).clamp(0.0, 1.0);
        let ahead = ramp((x - 8.5).max(0.0), 1.0) * ramp((4.0 - x).max(0.0), 1.0);
        [ahead * ramp((z - 2.0).max(0.0), 1.0), 0.0, 0.0]
    };
    let mut run = problem.start();
    let mut before = run.fields().clone();
    let mut balances = Vec::new();
    while let Some(point) = run.step() {
        let state = problem.evaluate(run.fields()).expect("own fields");
        let elastic = state.energy_release_n(q).expect("elastic");
        let crack = state.crack_resistance_n(q);
        let viscous = state.viscous_resistance_n(&before, 1.0, q).expect("a step of 1 s");
        if point.time_s > 3.5 {
            balances.push([elastic, crack, viscous].map(|n| 2.0 * n / THICKNESS / TOUGHNESS));
        }
        before = run.fields().clone();
    }
    assert!(balances.len() >= 4, "{balances:?}");
    for [elastic, crack, viscous] in &balances {
        assert!((elastic - crack - viscous).abs() < 0.03 * elastic, "{balances:?}");
        // a straight crack of AT2 on this mesh needs 1 + h/2ℓ₀ times the toughness
        assert!((crack - (1.0 + 0.1 / (2.0 * LENGTH))).abs() < 0.1, "{balances:?}");
        assert!(*viscous > 0.02 * elastic, "the crack does not grow: {balances:?}");
    }
}

#[test]
fn laws_with_a_state_are_refused() {
    let at = even(0.0, 1.0, 2);
    let series = Viscoelasticity::shear([PronyTerm { fraction: 0.3, time_s: 0.1 }]);
    let material = Material { fracture: None, ..matrix() }.with_viscoelasticity(series);
    let problem = Problem::builder(block([&at, &at, &at]))
        .materials([material])
        .conditions(Conditions::new().fix("bottom", Axis::ALL))
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    let state = problem.evaluate(&outcome.fields).expect("own fields");
    let refused = state.energy_release_n(|_| [1.0, 0.0, 0.0]);
    assert!(
        matches!(
            refused,
            Err(FemError::Unsupported { reason: Unsupported::EnergyReleaseWithState, .. })
        ),
        "{refused:?}"
    );
}
