//! The single-edge notched plate (Miehe, Hofacker & Welschinger 2010) in tension and in shear, on
//! coarse meshes. The benchmark computes converged values: `cargo bench -p fem --bench notched_plate`.

use crate::support::notched_plate::{Mode, NotchedPlate, kilonewton};

#[test]
fn the_notched_plate_agrees_with_the_reference_and_breaks_in_one_step() {
    // reference values for h = ℓ₀/4: 0.54237 kN at 0.004 mm, 0.65767 kN at 0.005 mm, peak 0.71074 kN at 0.00556 mm.
    // With h = ℓ₀, as in this test, the effective toughness is Gc (1 + h/2ℓ₀), 50 % larger, which increases the peak
    let plate = NotchedPlate {
        mode: Mode::Tension,
        hybrid: true,
        size_mm: 0.015,
        steps: vec![(0.004, 4), (0.006, 4), (0.0068, 1)],
    };
    let outcome = plate.problem(1e-3).run(&mut ());
    let at = |displacement: f64| {
        let near = |d: f64| (d - displacement).abs() < 1e-9;
        let point = outcome.curve.iter().find(|p| near(p.displacement_mm)).expect("a point");
        kilonewton(point, &plate)
    };
    for (displacement, recorded) in [(0.004, 0.54237), (0.005, 0.65767)] {
        let force = at(displacement);
        assert!((force - recorded).abs() < 0.01 * recorded, "{force} kN at {displacement} mm");
    }
    let peak = outcome.curve.iter().map(|p| kilonewton(p, &plate)).fold(0.0, f64::max);
    assert!(peak > 0.70 && peak < 0.80, "{peak} kN");
    let last = outcome.curve.last().expect("points");
    assert!(kilonewton(last, &plate) < 0.02 * peak, "it did not break: {last:?}");
    // the crack is a straight line from the notch to the opposite side
    let mesh = plate.mesh();
    for (x, phi) in mesh.nodes.iter().zip(&outcome.fields.damage) {
        let away = (x[1] - 0.5).abs();
        if away < 1e-9 && x[0] > 0.52 && x[0] < 0.9 {
            assert!(*phi > 0.9, "φ = {phi} on the path at {x:?}");
        } else if away > 0.1 {
            assert!(*phi < 0.2, "φ = {phi} away from the path at {x:?}");
        }
    }
}

#[test]
fn in_shear_the_crack_turns_down_and_the_force_agrees_with_a_two_dimensional_code() {
    let plate = NotchedPlate {
        mode: Mode::Shear,
        hybrid: false,
        size_mm: 0.03,
        steps: vec![(0.008, 2), (0.012, 2), (0.018, 4)],
    };
    let outcome = plate.problem(1e-3).run(&mut ());
    let at = |displacement: f64| {
        let near = |d: f64| (d - displacement).abs() < 1e-9;
        let point = outcome.curve.iter().find(|p| near(p.displacement_mm)).expect("a point");
        kilonewton(point, &plate)
    };
    // reference: `tests/python/notched_shear.py 0.03`, with small strain, triangles, and another solution method
    for (displacement, plane, tolerance) in
        [(0.004, 0.18804, 2e-3), (0.008, 0.37051, 2e-3), (0.012, 0.53830, 5e-3)]
    {
        let force = at(displacement);
        assert!((force - plane).abs() < tolerance * plane, "{force} kN at {displacement} mm");
    }
    // with the split, the crack grows only in the direction in which it opens, i.e. downwards from the slit tip;
    // without the split, the crack would grow in both directions. On finer meshes the crack bends to the right (table
    // in `fem::equations`)
    let mesh = plate.mesh();
    let cracked = mesh.nodes.iter().zip(&outcome.fields.damage).filter(|(_, phi)| **phi > 0.9);
    let lowest = cracked.clone().map(|(x, _)| x[1]).fold(1.0, f64::min);
    assert!((0.1..0.42).contains(&lowest), "the lowest point of the crack is at {lowest} mm");
    for (x, phi) in cracked {
        assert!(x[1] < 0.54 && (x[0] - 0.5).abs() < 0.1, "φ = {phi} at {x:?}");
    }
}
