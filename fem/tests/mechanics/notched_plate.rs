//! The single-edge notched plate (Miehe, Hofacker & Welschinger 2010; definitions 3.6, case 7) in
//! tension and in shear on coarse meshes; the converged figures are those of `cargo run --release -p
//! fem --bench notched_plate`.

use crate::support::notched_plate::{Mode, NotchedPlate, kilonewton};

#[test]
fn the_notched_plate_softens_as_the_record_says_and_breaks_at_once() {
    // the record, h = ℓ₀/4: 0.54237 kN at 0.004 mm, 0.65767 kN at 0.005 mm, peak 0.71074 kN at
    // 0.00556 mm. With h = ℓ₀ the crack costs Gc (1 + h/2ℓ₀), a half more, which shows at the peak
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
    // the crack has run straight to the other side and nowhere else
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
fn in_shear_the_crack_turns_down_and_the_force_is_that_of_a_plane_code() {
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
    // `tests/python/notched_shear.py 0.03`: small strain, triangles, by another path to equilibrium
    for (displacement, plane, tolerance) in
        [(0.004, 0.18804, 2e-3), (0.008, 0.37051, 2e-3), (0.012, 0.53830, 5e-3)]
    {
        let force = at(displacement);
        assert!((force - plane).abs() < tolerance * plane, "{force} kN at {displacement} mm");
    }
    // the crack goes where it opens, which is down from the tip of the slit; without the split it would
    // run to both sides. On finer meshes it bends to the right (the table of the equations)
    let mesh = plate.mesh();
    let cracked = mesh.nodes.iter().zip(&outcome.fields.damage).filter(|(_, phi)| **phi > 0.9);
    let lowest = cracked.clone().map(|(x, _)| x[1]).fold(1.0, f64::min);
    assert!((0.1..0.42).contains(&lowest), "it has come down to {lowest} mm");
    for (x, phi) in cracked {
        assert!(x[1] < 0.54 && (x[0] - 0.5).abs() < 0.1, "φ = {phi} at {x:?}");
    }
}
