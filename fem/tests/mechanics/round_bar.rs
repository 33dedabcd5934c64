//! A tapered round tension bar: elastic stiffness between the points of the extensometer, and invalid tests.

use fem::{
    End, FemError, Hardening, Material, Order, Plasticity, RoundBar, SolverOptions, TensionTest,
};

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
    let outcome = test.pull(&problem, 5e-6, 0.0);
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

/// The error of the stiffness is the error of the cross-section's area.
#[test]
fn a_finer_bar_is_closer_to_the_cone() {
    let errors = [1.6, 0.8].map(|spacing_mm| {
        let bar = RoundBar { taper_mm: 0.0, spacing_mm, ..BAR };
        (slope(bar) / YOUNG_MPA - 1.0).abs()
    });
    println!("relative errors of the slope {errors:?}");
    // about 1e-5 of the smaller error is due to the curvature of Hencky's law at the strain of the
    // reading
    assert!(errors[1] < errors[0] / 2.0 && errors[1] < 4e-5, "{errors:?}");
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

/// A bar of 304L steel (MatCal's point without rate dependence) necks in its middle.
///
/// By Considère's condition the largest engineering stress is S(ε) = σ_y(ε) e^(−ε) at A b e^(−b ε) = σ_y(ε), if a
/// section flows under uniaxial stress: the thinnest section determines the largest force. All other sections are
/// then less strained, so that the extensometer shows a smaller strain than Considère's condition gives; the
/// difference grows with the taper.
#[test]
fn a_taper_localises_the_neck_in_the_middle() {
    let (yield_mpa, saturation_mpa, rate) = (263.8_f64, 1100.94_f64, 1.945_57_f64);
    let limit = yield_mpa + saturation_mpa;
    let strain = (saturation_mpa * (rate + 1.0) / limit).ln() / rate;
    let largest_mpa = (limit - saturation_mpa * (-rate * strain).exp()) * (-strain).exp();
    let steel = Material::hencky(YOUNG_MPA, 0.27).with_plasticity(Plasticity {
        hardening: Hardening::Voce { saturation_mpa, rate },
        ..Plasticity::new(yield_mpa)
    });
    let mut strains_at_peak = Vec::new();
    for taper_mm in [0.01, 0.04] {
        let bar = RoundBar { taper_mm, spacing_mm: 1.5, ..BAR };
        let test = TensionTest::new(bar, EXTENSOMETER_MM, 1e-3, 0.8);
        let problem = test
            .builder(bar.eighth().unwrap())
            .unwrap()
            .order(Order::Quadratic)
            .materials([steel.clone()])
            .build()
            .unwrap();
        let outcome = test.pull(&problem, 0.7, 0.02);
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let curve = test.engineering_curve(&outcome.curve);
        let peak = curve.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        println!(
            "taper {taper_mm} mm: {:.2} MPa at {:.3}, in one dimension {largest_mpa:.2} MPa at {:.3}",
            peak.1,
            peak.0,
            strain.exp_m1()
        );
        assert!((peak.1 / largest_mpa - 1.0).abs() < 5e-3, "{peak:?} {largest_mpa}");
        assert!(peak.0 < strain.exp_m1(), "{peak:?} {strain}");
        strains_at_peak.push(peak.0);
        // the wall on the plane y = 0: deformed radius over initial radius, by height
        let mut wall: Vec<(f64, f64)> = problem
            .nodes()
            .iter()
            .zip(&outcome.fields.displacement)
            .filter(|(x, _)| x[1] == 0.0 && (x[0] - bar.radius_at(x[2])).abs() < 1e-9)
            .map(|(x, u)| (x[2], (x[0] + u[0]) / x[0]))
            .collect();
        wall.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [middle, end] = [wall[0].1, wall[wall.len() - 1].1];
        assert!(middle < 0.95 * end, "radius ratios {middle} in the middle and {end} at the end");
        assert!(wall.windows(2).all(|pair| pair[0].1 < pair[1].1 + 2e-3), "{wall:?}");
    }
    assert!(strains_at_peak[1] < strains_at_peak[0], "{strains_at_peak:?}");
}
