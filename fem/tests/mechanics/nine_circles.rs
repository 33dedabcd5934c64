//! Two of the nine circles of elastic brittle fracture; the example `nine_circles` computes all of them.

#[allow(dead_code)] // the test uses only some of the problems
#[path = "../../examples/nine_circles/circles/mod.rs"]
mod circles;

use circles::{Law, growth, uniform};

#[test]
fn a_bar_breaks_at_its_tensile_strength() {
    for law in Law::ALL {
        let verdict = uniform::uniaxial(law).expect("it runs");
        assert!(verdict.passed, "{law:?}: {verdict:?}");
        let off = verdict.value / verdict.reference - 1.0;
        assert!(off.abs() < 0.02, "{law:?}: {verdict:?}");
    }
}

/// The lengths ℓ₀ of the three laws differ by a factor of seven.
#[test]
fn a_long_crack_in_a_clamped_strip_grows_at_the_toughness() {
    for law in Law::ALL {
        let verdict = growth::pure_shear(law).expect("the crack grows");
        assert!(verdict.passed, "{law:?}: {verdict:?}");
    }
}

#[test]
fn a_plate_in_biaxial_tension_breaks_at_its_strength_with_the_law_of_the_strength_only() {
    let passed = Law::ALL.map(|law| uniform::biaxial(law).expect("it runs").passed);
    assert_eq!(passed, [false, false, true]);
}
