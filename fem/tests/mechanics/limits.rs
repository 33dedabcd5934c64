//! Values that are not finite cause errors: laws beyond their limit strain, and functions that return NaN.

use crate::support::{HEIGHT, RADIUS, prism};
use fem::{
    Axis, Conditions, End, FemError, HyperelasticLaw, Material, Order, Platen, PrincipalStrain,
    Problem, Scalar, Schedule, StepFailure,
};

/// Gent's law ψ = −μ J_m/2 ln(1 − (I₁ − 3)/J_m) − μ ln J + λ/2 (ln J)². Its energy is infinite at I₁ − 3 = J_m.
#[derive(Debug)]
struct Gent {
    shear_mpa: f64,
    lame_mpa: f64,
    limit: f64,
}

impl HyperelasticLaw for Gent {
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let stretch = strain.power_sum(2.0) / -self.limit;
        let volume = strain.log_volume();
        stretch.ln_1p() * (-0.5 * self.shear_mpa * self.limit) - volume * self.shear_mpa
            + volume * volume * (0.5 * self.lame_mpa)
    }
}

const GENT: Gent = Gent { shear_mpa: 1.0, lame_mpa: 2.0, limit: 0.5 };

/// Returns the axial nominal stress at the axial stretch λ. The lateral stretch b follows from zero lateral stress.
fn uniaxial(stretch: f64) -> f64 {
    let Gent { shear_mpa, lame_mpa, limit } = GENT;
    let stiffness = |b: f64| 1.0 / (1.0 - (stretch.powi(2) + 2.0 * b * b - 3.0) / limit);
    let along = |x: f64, b: f64| {
        let volume = (stretch * b * b).ln();
        shear_mpa * (x * stiffness(b) - 1.0 / x) + lame_mpa * volume / x
    };
    let (mut low, mut high) = (0.5, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        // beyond the limit strain, the lateral stress counts as infinite
        let inside = stretch.powi(2) + 2.0 * middle * middle - 3.0 < limit;
        if inside && along(middle, middle) < 0.0 { low = middle } else { high = middle }
    }
    along(stretch, low)
}

#[test]
fn a_run_with_gents_law_ends_at_the_limit_strain() {
    let material = Material::hyperelastic(GENT).expect("a law");
    let full = 0.9 * HEIGHT;
    let conditions = Conditions::new()
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, t| [0.0, 0.0, full * t])
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, 1.0]);
    for order in [Order::Linear, Order::Quadratic] {
        let problem = Problem::builder(prism(1, false))
            .order(order)
            .materials([material.clone()])
            .conditions(conditions.clone())
            .schedule(Schedule::fixed(1.0, 4))
            .build()
            .expect("valid");
        let outcome = problem.run(&mut ());
        let area = std::f64::consts::PI * RADIUS.powi(2);
        for point in &outcome.curve {
            let exact = area * uniaxial(1.0 + point.displacement_mm / HEIGHT);
            assert!((point.force_n / exact - 1.0).abs() < 1e-6, "{order:?}: {point:?}, {exact} N");
            assert!(point.elastic_n_mm.is_finite());
        }
        let End::Failed(error) = &outcome.end else { panic!("{order:?}: {:?}", outcome.end) };
        let FemError::NotConverged { source, displacement_mm, .. } = error else {
            panic!("{order:?}: {error}")
        };
        // λ² + 2b² − 3 = J_m with a lateral stretch b close to 0
        let limit = (3.0 + GENT.limit).sqrt();
        let reached = 1.0 + displacement_mm / HEIGHT;
        assert!((reached / limit - 1.0).abs() < 1e-3, "{order:?}: {error}");
        // the last step may also fail because rounding errors of the nearly infinite stiffness exceed the tolerance
        let is_limit =
            matches!(source, StepFailure::NotFinite | StepFailure::TooManyIterations { .. });
        assert!(is_limit, "{order:?}: {error}");
    }
}

#[test]
fn a_law_with_nan_at_zero_strain_is_rejected_and_a_law_with_a_small_limit_strain_is_accepted() {
    #[derive(Debug)]
    struct Broken;
    impl HyperelasticLaw for Broken {
        fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
            let [a, b, c] = strain.log();
            // the energy is NaN, but its derivatives are finite
            (a * a + b * b + c * c) + f64::NAN
        }
    }
    let error = Material::hyperelastic(Broken).expect_err("refused").to_string();
    assert!(error.contains("at zero strain is not zero"), "{error}");
    Material::hyperelastic(Gent { limit: 1e-4, ..GENT })
        .expect("a valid law with a small limit strain");
}

#[test]
fn functions_that_return_nan_are_reported() {
    let nan_from_half = |t: f64| if t > 0.5 { f64::NAN } else { 0.0 };
    let base = || Conditions::new().fix("bottom", Axis::ALL).measure("top", [0.0, 0.0, 1.0]);
    let platen = Platen::plane([0.0, 0.0, HEIGHT], [0.0, 0.0, -1.0])
        .moving(move |t| [0.0, 0.0, nan_from_half(t)]);
    for (what, conditions) in [
        ("traction", base().traction("top", move |_, t| [nan_from_half(t), 0.0, -1.0])),
        ("body force", base().body_force(move |_, t| [0.0, nan_from_half(t), 0.0])),
        (
            "prescribed value",
            base().prescribe("top", [Axis::Z], move |_, t| [0.0, 0.0, nan_from_half(t) - 0.01]),
        ),
        ("platen", base().platen("top", platen)),
        ("travel", base().measure_travel("top", [0.0, 0.0, 1.0], nan_from_half)),
    ] {
        let problem = Problem::builder(prism(1, false))
            .materials([Material::hencky(100.0, 0.3)])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, 2))
            .build()
            .expect("valid");
        let outcome = problem.run(&mut ());
        assert_eq!(outcome.curve.len(), 1, "{what}: {:?}", outcome.end);
        let End::Failed(error) = &outcome.end else { panic!("{what}: {:?}", outcome.end) };
        let FemError::NotConverged { source, .. } = error else { panic!("{what}: {error}") };
        assert_eq!(*source, StepFailure::Condition, "{what}: {error}");
        assert!(error.to_string().contains("finite numbers"), "{what}: {error}");
    }
}
