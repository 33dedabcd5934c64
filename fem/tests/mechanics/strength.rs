//! Materials with a strength of their own: strength and toughness of whole bodies for several regularisation lengths.

use super::sensitivity::{assert_differences, case, named};
use crate::support::block::{block, even, graded};
use crate::support::{grain, loading, matrix};
use fem::{
    Axis, Conditions, CrackDensity, End, Fracture, Material, Order, PhaseField, Problem,
    ProblemWarning, Schedule, Strength, TetMesh,
};

/// Graphite of Larsen, Dolbow & Lopez-Pamies (2024).
const YOUNG: f64 = 9800.0;
const POISSON: f64 = 0.13;
const TOUGHNESS: f64 = 0.091;
const TENSILE: f64 = 27.0;
const COMPRESSIVE: f64 = 77.0;

fn graphite(strength: Option<Strength>) -> Material {
    let fracture = Fracture { residual_stiffness: 1e-4, ..Fracture::new(TOUGHNESS) };
    Material { strength, ..Material::hencky(YOUNG, POISSON).with_fracture(fracture) }
}

fn at1(length_mm: f64) -> PhaseField {
    PhaseField { model: CrackDensity::At1, ..PhaseField::new(length_mm) }
}

/// Forces of a unit cube that is stretched to the given strains and can contract freely, with the largest damage.
fn stretched_cube(order: Order, length_mm: f64, strength: Option<Strength>) -> Vec<[f64; 3]> {
    let cells = even(0.0, 1.0, 3);
    let critical = TENSILE / YOUNG;
    // 98 % of the critical strain in one step, then steps of 1 %
    let strain = move |time_s: f64| {
        critical * if time_s < 1.0 { 0.98 * time_s } else { 0.97 + 0.01 * time_s }
    };
    let conditions = Conditions::new()
        .fix("bottom", [Axis::Z])
        .fix("left", [Axis::X])
        .fix("front", [Axis::Y])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, strain(time_s).exp_m1()])
        .measure("top", [0.0, 0.0, 1.0]);
    let problem = Problem::builder(block([&cells, &cells, &cells]))
        .order(order)
        .materials([graphite(strength)])
        .phase_field(at1(length_mm))
        .conditions(conditions)
        .schedule(Schedule::fixed(5.0, 5))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    outcome.curve.iter().map(|p| [p.displacement_mm.ln_1p(), p.force_n, p.phi_max]).collect()
}

/// A uniform body breaks at the tensile strength, whatever the regularisation length. AT1 alone breaks at
/// √(3 E Gc/(8 ℓ₀)), which is 41 MPa for 0.2 mm and 82 MPa for 0.05 mm.
#[test]
fn tensile_strength_of_a_uniform_body_does_not_depend_on_the_length() {
    for order in [Order::Linear, Order::Quadratic] {
        for length_mm in [0.2, 0.05] {
            let curve = stretched_cube(order, length_mm, Some(Strength::new(TENSILE, COMPRESSIVE)));
            let mut broken = 0;
            for [strain, force, damage] in &curve {
                if *strain < 0.9999 * TENSILE / YOUNG {
                    // the nominal stress E ε/λ^(1 + 2 ν − 2 ν) of Hencky's law is the Kirchhoff stress divided by the stretch
                    let exact = YOUNG * strain / strain.exp();
                    assert!((force - exact).abs() < 1e-6 * exact, "{force} instead of {exact} N");
                    assert_eq!(*damage, 0.0, "strain {strain}, length {length_mm}");
                } else if *strain > 1.0001 * TENSILE / YOUNG {
                    assert!(*damage > 0.0, "no damage at {strain}, length {length_mm}");
                    broken += 1;
                }
            }
            let highest = curve.iter().map(|row| row[1]).fold(0.0, f64::max);
            assert!(broken > 0 && highest < 1.001 * TENSILE, "{order:?} {length_mm}: {curve:?}");
        }
    }
    let alone = stretched_cube(Order::Linear, 0.2, None);
    assert!(alone.len() == 5 && alone.iter().all(|row| row[2] == 0.0), "{alone:?}");
}

/// Height of the strip, mm.
const HEIGHT: f64 = 8.0;
/// Length of the slit, mm.
const SLIT: f64 = 5.0;
/// Size of the elements around the path of the crack, mm.
const SIZE: f64 = 0.1;

/// Coordinates from `from` to `to` with spacing `SIZE` between the two ends of `fine`; outside, the spacing grows.
fn refined(from: f64, fine: [f64; 2], to: f64) -> Vec<f64> {
    let outwards = |start: f64, end: f64| {
        let mut at = graded(1.5 * SIZE, 1, 1.5, (end - start).abs());
        at.remove(0);
        at.into_iter().map(move |x| start + (end - start).signum() * x)
    };
    let cells = ((fine[1] - fine[0]) / SIZE).round() as usize;
    let mut coordinates: Vec<f64> = outwards(fine[0], from).collect();
    coordinates.reverse();
    coordinates.extend(even(fine[0], fine[1], cells));
    coordinates.extend(outwards(fine[1], to));
    coordinates
}

/// A strip with a slit along its middle, from its left side, of the width of one element.
fn strip() -> TetMesh {
    let along = refined(0.0, [SLIT - 0.2, SLIT + 2.5], 14.0);
    let half = 3.5 * SIZE;
    let across = refined(-0.5 * HEIGHT, [-half, half], 0.5 * HEIGHT);
    let mut mesh = block([&along, &[0.0, SIZE], &across]);
    let is_slit = |tet: &[u32; 4]| {
        let centre = |axis| tet.iter().map(|&n| mesh.nodes[n as usize][axis]).sum::<f64>() / 4.0;
        centre(0) < SLIT && centre(2).abs() < 0.5 * SIZE
    };
    let kept: Vec<_> = mesh.tets.iter().copied().filter(|tet| !is_slit(tet)).collect();
    mesh.region_of.truncate(kept.len());
    mesh.tets = kept;
    mesh.with_surfaces(|[_, y, z], [_, across, up]| {
        if across.abs() > 0.9 {
            Some(if y < 0.5 * SIZE { "front" } else { "back" })
        } else if z.abs() > 0.499 * HEIGHT {
            Some(if up > 0.0 { "top" } else { "bottom" })
        } else {
            None
        }
    })
}

/// Opens the strip, more at its left side than at its right side, so that the crack grows stably. Returns the opening
/// at the left side (mm) and the stiffness (N/mm) after each step.
fn opened_strip(material: Material, length_mm: f64) -> Vec<[f64; 2]> {
    let (first, rise, steps) = (0.0175, 0.0005, 10);
    let opening = move |time_s: f64| {
        if time_s < 1.0 { first * time_s } else { first + rise * (time_s - 1.0) }
    };
    let conditions = Conditions::new()
        .fix("front", [Axis::Y])
        .fix("back", [Axis::Y])
        .fix("bottom", [Axis::X, Axis::Z])
        .prescribe("top", [Axis::X, Axis::Z], move |[x, ..], time_s| {
            [0.0, 0.0, opening(time_s) * (1.0 - x / 14.0)]
        })
        .measure("top", [0.0, 0.0, 1.0]);
    let problem = Problem::builder(strip())
        .materials([material])
        .phase_field(at1(length_mm))
        .conditions(conditions)
        .schedule(Schedule::fixed(f64::from(steps), steps))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome.curve.iter().map(|p| (opening(p.time_s), p.force_n)).map(|(u, f)| [u, f / u]).collect()
}

/// Opening at which the falling stiffness has the given value, interpolated linearly.
fn opening_at(steps: &[[f64; 2]], stiffness: f64) -> f64 {
    let pair = steps.windows(2).find(|pair| pair[0][1] > stiffness && pair[1][1] <= stiffness);
    let Some([[u, from], [v, to]]) = pair.and_then(|pair| <[_; 2]>::try_from(pair).ok()) else {
        panic!("no stiffness of {stiffness} N/mm in {steps:?}")
    };
    u + (v - u) * (from - stiffness) / (from - to)
}

/// Strips with cracks of equal length have the same stiffness. At equal stiffness, the energy release rate is therefore
/// proportional to the square of the opening. On a mesh of size h, a crack with AT1 alone needs 1 + 3 h/(8 ℓ₀) times the
/// toughness. With a strength, a crack needs the toughness, because the factor of the toughness compensates for the mesh.
#[test]
fn a_crack_grows_at_the_toughness_of_the_material() {
    const LENGTH: f64 = 0.3;
    let viscous = |mut material: Material| {
        material.fracture.as_mut().expect("graphite breaks").viscosity_mpa_s = 0.005;
        material
    };
    let strength = Strength { node_spacing_mm: Some(SIZE), ..Strength::new(TENSILE, COMPRESSIVE) };
    let alone = opened_strip(viscous(graphite(None)), LENGTH);
    let with_strength = opened_strip(viscous(graphite(Some(strength))), LENGTH);
    for stiffness in [320.0, 285.0] {
        let ratio = opening_at(&with_strength, stiffness) / opening_at(&alone, stiffness);
        let toughness = ratio.powi(2) * (1.0 + 3.0 * SIZE / (8.0 * LENGTH));
        assert!((toughness - 1.0).abs() < 0.06, "{toughness} Gc at {stiffness} N/mm");
    }
}

/// A regularisation length with an inaccurate compressive strength causes a warning.
#[test]
fn a_compressive_strength_that_the_length_changes_is_named() {
    let warnings = |length_mm: f64, strength: Strength| {
        let cells = even(0.0, 1.0, 2);
        let problem = Problem::builder(block([&cells, &cells, &cells]))
            .materials([graphite(Some(strength))])
            .phase_field(at1(length_mm))
            .conditions(Conditions::new().fix("bottom", Axis::ALL))
            .schedule(Schedule::fixed(1.0, 1))
            .build()
            .expect("valid");
        problem.warnings()
    };
    let strength = Strength { node_spacing_mm: Some(1e-4), ..Strength::new(TENSILE, COMPRESSIVE) };
    assert_eq!(warnings(0.002, strength), []);
    let named = warnings(0.2, strength);
    let [ProblemWarning::CompressiveStrength { realised_mpa, .. }] = &named[..] else {
        panic!("{named:?}")
    };
    assert!(*realised_mpa > TENSILE && *realised_mpa < 0.9 * COMPRESSIVE, "{realised_mpa} MPa");
    assert!(named[0].to_string().contains("region 'matrix'"), "{}", named[0]);
}

#[test]
fn strengths_are_differentiated() {
    const STRENGTH: Strength = Strength::new(1.2, 3.0);
    fn materials(strength: Strength) -> Vec<Material> {
        vec![matrix().with_strength(strength), grain()]
    }
    let parameters = [
        named("tensile", 1.2, |tensile_mpa| materials(Strength { tensile_mpa, ..STRENGTH })),
        named("compressive", 3.0, |compressive_mpa| {
            materials(Strength { compressive_mpa, ..STRENGTH })
        }),
        named("toughness", 0.0025, |x| {
            let mut changed = materials(STRENGTH);
            changed[0].fracture.as_mut().expect("it breaks").toughness_n_per_mm = x;
            changed
        }),
    ];
    for order in [Order::Linear, Order::Quadratic] {
        let mut case = case(order, at1(0.06));
        case.options.alternations = 4000;
        case.options.tolerance = 1e-12;
        case.loading = loading(0.1, 1.0, 10);
        let problem = case.problem(materials(STRENGTH));
        assert_differences(&problem, &parameters, &format!("{order:?}"));
    }
}
