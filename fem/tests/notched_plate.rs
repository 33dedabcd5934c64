//! Single-edge notched tension (Miehe, Hofacker & Welschinger 2010; definitions 3.6, case 7) on a
//! coarse mesh; the converged figures are those of `cargo run --release -p fem --example
//! notched_plate`.

#[path = "support/notched_plate.rs"]
mod notched;

use notched::{NotchedPlate, kilonewton};

#[test]
fn the_notched_plate_softens_as_the_record_says_and_breaks_at_once() {
    // the record, h = ℓ₀/4: 0.54237 kN at 0.004 mm, 0.65767 kN at 0.005 mm, peak 0.71074 kN at
    // 0.00556 mm. With h = ℓ₀ the crack costs Gc (1 + h/2ℓ₀), a half more, which shows at the peak
    let plate = NotchedPlate { size_mm: 0.015, steps: vec![(0.004, 4), (0.006, 4), (0.0068, 1)] };
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
