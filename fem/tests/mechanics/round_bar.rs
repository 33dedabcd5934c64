//! A tapered round tension bar: elastic stiffness between the points of the extensometer, and invalid tests.

use fem::{End, FemError, Material, Order, RoundBar, SolverOptions, TensionTest};

const BAR: RoundBar = RoundBar {
    radius_mm: 3.175,
    taper_mm: 0.05,
    length_mm: 31.75,
    necking_mm: 7.0,
    spacing_mm: 0.8,
};
const EXTENSOMETER_MM: f64 = 19.05;
const YOUNG_MPA: f64 = 199_950.0;

/// Returns the ratio of engineering stress to engineering strain of an elastic bar at a small strain (MPa).
fn slope(bar: RoundBar) -> f64 {
    let test = TensionTest::new(bar, EXTENSOMETER_MM, 1e-3, 1e-2);
    let problem = test
        .builder(bar.eighth().unwrap())
        .unwrap()
        .order(Order::Quadratic)
        .materials([Material::hencky(YOUNG_MPA, 0.27)])
        .options(SolverOptions { tolerance: 1e-10, ..SolverOptions::default() })
        .build()
        .unwrap();
    let outcome = test.pull(&problem, 5e-6);
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let (strain, stress_mpa) = test.engineering(&outcome.curve[0]);
    assert_eq!(outcome.curve.len(), 1);
    stress_mpa / strain
}

/// A cone with the radii a and b elongates by F l / (E π a b), so that its slope is E b / a. The cross-sections of a
/// slightly tapered bar remain nearly plane, with an error of the order of the square of the slope of the wall, 1e-5.
#[test]
fn a_tapered_bar_has_the_stiffness_of_a_cone() {
    for taper_mm in [0.0, 0.05] {
        let bar = RoundBar { taper_mm, ..BAR };
        let exact = YOUNG_MPA * bar.radius_at(0.5 * EXTENSOMETER_MM) / bar.radius_mm;
        let error = slope(bar) / exact - 1.0;
        println!("taper {taper_mm} mm: relative error of the slope {error:.2e}");
        assert!(error.abs() < 5e-4, "{error}");
    }
}

/// The error of the stiffness is the error of the cross-section's area, which decreases with the fourth power of the
/// spacing.
#[test]
fn a_finer_bar_is_closer_to_the_cone() {
    let errors = [1.6, 0.8].map(|spacing_mm| {
        let bar = RoundBar { taper_mm: 0.0, spacing_mm, ..BAR };
        (slope(bar) / YOUNG_MPA - 1.0).abs()
    });
    println!("relative errors of the slope {errors:?}");
    assert!(errors[1] < errors[0] / 6.0, "{errors:?}");
}

#[test]
fn impossible_tests_are_refused_with_their_field() {
    let test = TensionTest::new(BAR, EXTENSOMETER_MM, 1e-3, 0.8);
    let field = |test: TensionTest| match test.builder(BAR.eighth().unwrap()) {
        Err(error @ FemError::OutOfRange { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let long = field(TensionTest { extensometer_mm: 40.0, ..test });
    assert!(long.contains("extensometer_mm = 40"), "{long}");
    let still = field(TensionTest { rate_per_s: 0.0, ..test });
    assert!(still.contains("rate_per_s = 0"), "{still}");
    let none = field(TensionTest { strain: f64::NAN, ..test });
    assert!(none.contains("strain"), "{none}");
}
