//! Load programs: hold, unloading and reloading, compared with closed forms of a uniform specimen.

use crate::support::{HEIGHT, RADIUS, matrix, phase_field, prism};
use fem::{
    AdaptiveSteps, Checkpoint, CompressionTest, CurvePoint, End, LoadProgram, Material, Order,
    Outcome, Platens, Problem, ProgramPoint, Schedule, SegmentSteps, SolverOptions, Split,
};

const LENGTH: f64 = 0.06;

fn area() -> f64 {
    std::f64::consts::PI * RADIUS * RADIUS
}

fn program(points: &[(f64, f64)]) -> LoadProgram {
    let points = points.iter().map(|&(time_s, u)| ProgramPoint::new(time_s, u)).collect();
    LoadProgram::new(points).expect("a program")
}

fn problem(test: &CompressionTest, material: Material, breaks: bool) -> Problem {
    let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
    test.builder(prism(2, false))
        .expect("platens")
        .order(Order::Linear)
        .materials([material])
        .phase_field(breaks.then(|| phase_field(Split::None)))
        .options(options)
        .build()
        .expect("a problem")
}

fn run(test: &CompressionTest, material: Material, breaks: bool) -> Outcome {
    let outcome = problem(test, material, breaks).run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome
}

/// Axial logarithmic strain, positive in compression, and the axial stretch.
fn strain(displacement_mm: f64) -> [f64; 2] {
    let stretch = 1.0 - displacement_mm / HEIGHT;
    [-stretch.ln(), stretch]
}

#[test]
fn an_elastic_body_follows_hold_unloading_and_reloading() {
    let program = program(&[(0.1, 0.2), (5.0, 0.2), (5.5, 0.04), (6.0, 0.04), (8.0, 0.3)]);
    let elastic = Material::hencky(275.0, 0.25);
    for platens in [Platens::Sliding, Platens::Unilateral(fem::Friction::none())] {
        for steps in [SegmentSteps::Fixed(3), SegmentSteps::default()] {
            let test = CompressionTest::following(program.clone(), steps).platens(platens);
            let outcome = run(&test, elastic.clone(), false);
            for point in &outcome.curve {
                let CurvePoint { time_s, displacement_mm: u, force_n, .. } = *point;
                let stated = program.displacement_mm(time_s).expect("a displacement");
                assert!((u - stated).abs() < 1e-12, "{point:?}");
                let [e, stretch] = strain(u);
                let exact = area() * 275.0 * e / stretch;
                assert!(
                    (force_n - exact).abs() < 1e-7 * exact,
                    "{platens:?}: {point:?}, {exact} N"
                );
            }
            for corner in program.points() {
                let is_here = |p: &CurvePoint| {
                    (p.time_s - corner.time_s).abs() < 1e-9
                        && Some(p.displacement_mm) == corner.displacement_mm()
                };
                assert!(outcome.curve.iter().any(is_here), "{corner:?} is no point of the curve");
            }
        }
    }
}

#[test]
fn a_segment_has_the_steps_of_its_point_or_the_usual_ones() {
    let points = vec![
        ProgramPoint { steps: Some(4), ..ProgramPoint::new(1.0, 0.1) },
        ProgramPoint::new(3.0, 0.1),
        ProgramPoint { steps: Some(1), ..ProgramPoint::new(4.0, 0.0) },
    ];
    let program = LoadProgram::new(points).expect("a program");
    let times = |usual| {
        let test = CompressionTest::following(program.clone(), usual);
        let outcome = run(&test, Material::hencky(275.0, 0.25), false);
        outcome.curve.iter().map(|p| p.time_s).collect::<Vec<f64>>()
    };
    let near = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-12, "{found:?}"));
    };
    near(&times(SegmentSteps::Fixed(2)), &[0.25, 0.5, 0.75, 1.0, 2.0, 3.0, 4.0]);
    let adaptive = SegmentSteps::Adaptive(AdaptiveSteps { first: 0.1, largest: 0.4 });
    // 0.1, then 1.5 times as long, at most 0.4 of the segment of 2 s
    let adaptive = times(adaptive);
    near(&adaptive[..4], &[0.25, 0.5, 0.75, 1.0]);
    near(&adaptive[4..7], &[1.2, 1.5, 1.95]);
    near(&adaptive[adaptive.len() - 2..], &[3.0, 4.0]);
}

/// Damage of a uniform specimen by the backward Euler rule. With AT2 and without a split, each step is a linear equation:
/// ξ (φ − φₙ)/Δt = 2 (1 − η)(1 − φ) ψ − Gc/ℓ₀ φ.
fn damage_after(phi: f64, displacement_mm: f64, duration_s: f64) -> f64 {
    let m = matrix().fracture.expect("a material that breaks");
    let [e, _] = strain(displacement_mm);
    let drive = (1.0 - m.residual_stiffness) * 275.0 * e * e;
    let rate = m.viscosity_mpa_s / duration_s;
    (rate * phi + drive) / (rate + drive + m.toughness_n_per_mm / LENGTH)
}

fn force(displacement_mm: f64, phi: f64) -> f64 {
    let eta = matrix().fracture.expect("a material that breaks").residual_stiffness;
    let [e, stretch] = strain(displacement_mm);
    ((1.0 - eta) * (1.0 - phi) * (1.0 - phi) + eta) * 275.0 * area() * e / stretch
}

#[test]
fn damage_grows_during_a_hold_and_the_force_is_that_of_the_scalar_equation() {
    let program = program(&[(0.2, 0.08), (1.2, 0.08), (1.4, 0.03), (1.9, 0.16)]);
    let outcome =
        run(&CompressionTest::following(program, SegmentSteps::Fixed(20)), matrix(), true);
    assert_eq!(outcome.curve.len(), 80);
    let (mut phi, mut before_s) = (0.0, 0.0);
    for point in &outcome.curve {
        phi = damage_after(phi, point.displacement_mm, point.time_s - before_s);
        before_s = point.time_s;
        let exact = force(point.displacement_mm, phi);
        assert!((point.force_n - exact).abs() < 1e-6 * exact, "{point:?}: {exact} N");
    }
    let forces: Vec<f64> = outcome.curve[19..40].iter().map(|p| p.force_n).collect();
    assert!(forces.windows(2).all(|pair| pair[1] < pair[0]), "the force relaxes: {forces:?}");
    assert!(forces[20] < 0.9 * forces[0], "time matters: {forces:?}");
}

#[test]
fn a_hold_converges_to_the_exponential_approach_of_equilibrium() {
    // during a hold the damage obeys φ̇ = (φ∞ − φ)/τ with τ = ξ/(2 (1 − η) ψ + Gc/ℓ₀)
    let m = matrix().fracture.expect("a material that breaks");
    let (hold_s, u) = (0.4, 0.08);
    let [e, _] = strain(u);
    let drive = (1.0 - m.residual_stiffness) * 275.0 * e * e;
    let stiffness = drive + m.toughness_n_per_mm / LENGTH;
    let errors = [20, 40, 80].map(|steps| {
        let ramp = ProgramPoint { steps: Some(10), ..ProgramPoint::new(0.2, u) };
        let hold = ProgramPoint { steps: Some(steps), ..ProgramPoint::new(0.2 + hold_s, u) };
        let program = LoadProgram::new(vec![ramp, hold]).expect("a program");
        let curve =
            run(&CompressionTest::following(program, SegmentSteps::default()), matrix(), true)
                .curve;
        let [start, end] = [curve[9].phi_mean, curve[curve.len() - 1].phi_mean];
        let limit = drive / stiffness;
        let exact = limit + (start - limit) * (-hold_s * stiffness / m.viscosity_mpa_s).exp();
        assert!(exact - start > 0.05, "the damage grows: {start} to {exact}");
        (end - exact).abs()
    });
    for pair in errors.windows(2) {
        assert!((1.8..2.2).contains(&(pair[0] / pair[1])), "first order: {errors:?}");
    }
}

#[test]
fn the_stop_below_the_peak_waits_for_displacements_that_are_new() {
    let program = program(&[(0.5, 0.1), (1.0, 0.02), (2.0, 0.22)]);
    let mut test = CompressionTest::following(program.clone(), SegmentSteps::Fixed(40));
    test.schedule = test.schedule.stop_below_peak(0.1);
    let outcome = problem(&test, matrix(), true).run(&mut ());
    assert!(matches!(outcome.end, End::BelowPeak), "{:?}", outcome.end);
    let last = outcome.curve.last().expect("points");
    assert!(
        last.time_s > 1.0 && last.displacement_mm > 0.1,
        "unloading does not stop it: {last:?}"
    );
    let peak = outcome.curve.iter().map(|p| p.force_n).fold(0.0, f64::max);
    assert!(last.force_n < 0.9 * peak, "{last:?}, {peak} N");
    let reloads = outcome.curve.iter().filter(|p| p.time_s > 1.0 && p.displacement_mm < 0.1);
    assert!(reloads.clone().any(|p| p.force_n < 0.5 * peak), "reloading begins far below the peak");
}

#[test]
fn a_run_resumes_within_a_hold_with_the_same_bits() {
    let dir = tempfile::tempdir().expect("a directory");
    let program = program(&[(0.2, 0.08), (0.7, 0.08), (0.9, 0.02)]);
    let test = CompressionTest::following(program, SegmentSteps::Fixed(6));
    let problem = problem(&test, matrix(), true);
    let at = |name: &str| Checkpoint { path: dir.path().join(name), every: 2 };
    let whole = problem.run_resumable(&at("whole"), &mut ()).expect("a run");
    for interrupted_after in [6, 9, 12] {
        let checkpoint = at(&format!("after-{interrupted_after}"));
        let mut first = problem.resume(&checkpoint).expect("a run");
        for _ in 0..interrupted_after {
            first.step();
        }
        drop(first);
        let resumed = problem.run_resumable(&checkpoint, &mut ()).expect("resumed");
        assert_eq!(resumed.curve, whole.curve, "{interrupted_after}");
    }
    let other = self::program(&[(0.2, 0.08), (0.7, 0.08), (0.9, 0.03)]);
    let other = CompressionTest::following(other, SegmentSteps::Fixed(6));
    let other = self::problem(&other, matrix(), true);
    let refused = other.resume(&at("whole"));
    assert!(refused.is_err(), "the state belongs to another program");
}

#[test]
fn a_program_of_constant_speed_is_the_plain_test() {
    let plain = CompressionTest::new(0.15, Schedule::fixed(0.5, 12));
    let program = program(&[(0.5, 0.15)]);
    let programmed = CompressionTest::following(program, SegmentSteps::Fixed(12));
    let [plain, programmed] = [plain, programmed].map(|test| run(&test, matrix(), true).curve);
    assert_eq!(plain, programmed);
}

#[test]
fn impossible_programs_are_refused_with_their_point() {
    let refused = |points: &[(f64, f64)]| {
        let points = points.iter().map(|&(time_s, u)| ProgramPoint::new(time_s, u)).collect();
        LoadProgram::new(points).expect_err("refused").to_string()
    };
    for (points, words) in [
        (&[][..], ["load program", "displacement_mm = 0"]),
        (&[(1.0, 0.1), (0.5, 0.2)], ["point 2", "time_s = 0.5"]),
        (&[(1.0, 0.1), (1.0, 0.2)], ["point 2", "time_s = 1"]),
        (&[(0.0, 0.1)], ["point 1", "time_s = 0"]),
        (&[(f64::NAN, 0.1)], ["point 1", "time_s = NaN"]),
        (&[(1.0, 0.1), (1.0 + 1e-12, 0.2)], ["point 2", "1e-9"]),
        (&[(1.0, 0.1), (2.0, -0.1)], ["point 2", "displacement_mm = -0.1"]),
        (&[(1.0, f64::INFINITY)], ["point 1", "displacement_mm = inf"]),
        (&[(1.0, 0.0), (2.0, 0.0)], ["displacement_mm = 0", "positive"]),
    ] {
        let message = refused(points);
        assert!(words.iter().all(|word| message.contains(word)), "{points:?}: {message}");
    }
    let point = ProgramPoint { steps: Some(0), ..ProgramPoint::new(1.0, 0.1) };
    let message = LoadProgram::new(vec![point]).expect_err("refused").to_string();
    assert!(message.contains("steps = 0"), "{message}");
    let high = program(&[(1.0, 0.1), (2.0, 1.1 * HEIGHT)]);
    let high = CompressionTest::following(high, SegmentSteps::default()).builder(prism(1, false));
    let message = high.expect_err("refused").to_string();
    assert!(message.contains("displacement_mm") && message.contains("height"), "{message}");
}
