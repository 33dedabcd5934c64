//! Load programs that prescribe the force of the platen: creep, cycles, limit load, and derivatives.

use std::ops::ControlFlow;

use crate::support::{HEIGHT, RADIUS, grain, matrix, phase_field, prism};
use fem::{
    Checkpoint, CompressionTest, CurvePoint, End, FemError, Fields, Fracture, Friction,
    Irreversibility, LinearScheme, LoadProgram, Material, MaterialParameter, Order, Outcome,
    PhaseField, Platens, Problem, ProgramPoint, PronyTerm, SegmentSteps, SolverOptions, Split,
    Unsupported, Viscoelasticity,
};

fn area() -> f64 {
    std::f64::consts::PI * RADIUS * RADIUS
}

fn program(points: &[ProgramPoint]) -> LoadProgram {
    LoadProgram::new(points.to_vec()).expect("a program")
}

/// Grains in a matrix that breaks.
fn of_grains(
    test: &CompressionTest,
    order: Order,
    linear: LinearScheme,
    field: Option<PhaseField>,
) -> Problem {
    let options = SolverOptions {
        linear,
        tolerance: 1e-11,
        linear_tolerance: 1e-3,
        ..SolverOptions::default()
    };
    test.builder(prism(2, true))
        .expect("platens")
        .order(order)
        .materials([matrix(), grain()])
        .phase_field(field)
        .options(options)
        .build()
        .expect("a problem")
}

fn run(problem: &Problem) -> Outcome {
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome
}

/// Runs a test with prescribed displacement, then a test in which the forces of the first test are prescribed, and
/// checks that both have the same equilibria. Returns the number of iterations with prescribed force and with
/// prescribed displacement.
fn assert_same_equilibria(
    order: Order,
    linear: LinearScheme,
    field: Option<PhaseField>,
    platens: Platens,
) -> [u32; 2] {
    let case = format!("{order:?} {linear:?} {platens:?}");
    // each point is a corner, because the force is not a linear function of time
    let points: Vec<ProgramPoint> =
        (1..=4).map(f64::from).map(|k| ProgramPoint::new(0.25 * k, 0.015 * k)).collect();
    let by_displacement = CompressionTest::following(program(&points), SegmentSteps::Fixed(1));
    let given = run(&of_grains(&by_displacement.platens(platens), order, linear, field));
    let points: Vec<ProgramPoint> =
        given.curve.iter().map(|p| ProgramPoint::force(p.time_s, p.force_n)).collect();
    let by_force = CompressionTest::following(program(&points), SegmentSteps::Fixed(1));
    let found = run(&of_grains(&by_force.platens(platens), order, linear, field));
    assert_eq!(found.curve.len(), given.curve.len(), "{case}");
    for (a, b) in found.curve.iter().zip(&given.curve) {
        assert!((a.force_n / b.force_n - 1.0).abs() < 1e-8, "{case}: {a:?} {b:?}");
        assert!((a.displacement_mm / b.displacement_mm - 1.0).abs() < 1e-8, "{case}: {a:?} {b:?}");
        let energy = b.elastic_n_mm + b.fracture_n_mm;
        assert!((a.elastic_n_mm - b.elastic_n_mm).abs() < 1e-7 * energy, "{case}: {a:?} {b:?}");
        assert!((a.work_n_mm - b.work_n_mm).abs() < 1e-6 * energy, "{case}: {a:?} {b:?}");
        assert!(a.force_is_prescribed && !b.force_is_prescribed, "{case}");
    }
    let last = found.curve[3].displacement_mm;
    let lowest = found.fields.displacement.iter().map(|u| u[2]).fold(0.0, f64::min);
    assert!(lowest <= -last + 1e-6 * last, "{case}: {lowest} {last}");
    assert_eq!(found.fields.platen_mm, last);
    [found.effort.iterations, given.effort.iterations]
}

#[test]
fn a_prescribed_force_gives_the_displacement_that_gives_the_force() {
    use LinearScheme::{Direct, Multigrid};
    let unilateral = Platens::Unilateral(Friction::none());
    let rough = Platens::Unilateral(Friction { coefficient: 0.2, ..Friction::none() });
    for (order, linear) in [
        (Order::Linear, Direct),
        (Order::Linear, Multigrid),
        (Order::Quadratic, Direct),
        (Order::Quadratic, Multigrid),
    ] {
        for platens in [Platens::Sliding, unilateral, rough] {
            let [by_force, given] = assert_same_equilibria(order, linear, None, platens);
            println!("{order:?} {linear:?} {platens:?}: {by_force} and {given} iterations");
            // the initial guess is not extrapolated at a corner. A prescribed displacement moves the body by its linear
            // response; a prescribed force needs one iteration for this response
            assert!(by_force <= given + 8, "{order:?} {linear:?} {platens:?}: {by_force} {given}");
        }
    }
}

#[test]
fn damage_is_the_same_with_prescribed_force_and_prescribed_displacement() {
    let at_set =
        PhaseField { irreversibility: Irreversibility::ActiveSet, ..phase_field(Split::None) };
    for field in [phase_field(Split::VolumetricDeviatoric), at_set] {
        for order in [Order::Linear, Order::Quadratic] {
            let direct = LinearScheme::Direct;
            assert_same_equilibria(order, direct, Some(field), Platens::Sliding);
        }
    }
}

/// Constants of a viscoelastic body: one Prony term of the shear modulus.
const FRACTION: f64 = 0.4;
const TAU_S: f64 = 0.8;

fn binder(young_mpa: f64) -> Material {
    let series = Viscoelasticity::shear([PronyTerm { fraction: FRACTION, time_s: TAU_S }]);
    Material::hencky(young_mpa, 0.25).with_viscoelasticity(series)
}

/// Integral of the uniaxial creep compliance J(t) = 1/(9K) + J_s(t)/3 from 0 to t, s/MPa, with the shear compliance
/// J_s(t) = (1 + g/(1 − g) (1 − exp(−(1 − g) t/τ)))/G.
fn compliance_integral(t: f64) -> f64 {
    let (bulk, shear) = (275.0 / 1.5, 275.0 / 2.5);
    if t <= 0.0 {
        return 0.0;
    }
    let rate = (1.0 - FRACTION) / TAU_S;
    let delayed = FRACTION / (1.0 - FRACTION) * (t - (1.0 - (-rate * t).exp()) / rate);
    t / (9.0 * bulk) + (t + delayed) / (3.0 * shear)
}

/// A cylinder with free sides creeps under a constant force, as the closed form states for small strains.
#[test]
fn a_viscoelastic_cylinder_creeps_by_its_compliance() {
    let (ramp_s, end_s, force_n) = (0.1, 3.0, 0.05);
    let error = |order: Order, steps: u32| {
        let points = [
            ProgramPoint { steps: Some(steps / 4), ..ProgramPoint::force(ramp_s, force_n) },
            ProgramPoint { steps: Some(steps), ..ProgramPoint::force(end_s, force_n) },
        ];
        let test = CompressionTest::following(program(&points), SegmentSteps::Fixed(1));
        let problem = test
            .builder(prism(2, false))
            .expect("platens")
            .order(order)
            .materials([binder(275.0)])
            .options(SolverOptions { tolerance: 1e-10, ..SolverOptions::default() })
            .build()
            .expect("a problem");
        let mut worst = 0.0_f64;
        for point in run(&problem).curve {
            let CurvePoint { time_s: t, displacement_mm, force_n: reached_n, .. } = point;
            assert!((reached_n - force_n * (t / ramp_s).min(1.0)).abs() < 1e-9 * force_n);
            let stress_rate = force_n / area() / ramp_s;
            let since = compliance_integral(t) - compliance_integral(t - ramp_s);
            let exact = HEIGHT * stress_rate * since;
            worst = worst.max((displacement_mm / exact - 1.0).abs());
        }
        worst
    };
    for order in [Order::Linear, Order::Quadratic] {
        let errors = [16, 32, 64].map(|steps| error(order, steps));
        println!("{order:?}: {errors:?}");
        assert!(errors[2] < 2e-3, "{order:?}: {errors:?}");
        // the error decreases at least in proportion to the time step
        assert!(errors[1] < 0.6 * errors[0] && errors[2] < 0.6 * errors[1], "{errors:?}");
    }
}

/// Force, displacement and cycles in one program: the elastic body has the closed form at every point.
#[test]
fn segments_of_force_and_displacement_follow_each_other() {
    let elastic = |displacement_mm: f64| {
        let stretch = 1.0 - displacement_mm / HEIGHT;
        area() * 275.0 * -stretch.ln() / stretch
    };
    let points = [
        ProgramPoint::new(0.5, 0.1),
        ProgramPoint::force(1.0, 800.0),
        ProgramPoint::force(2.0, 800.0),
        ProgramPoint::force(2.5, 100.0),
        ProgramPoint::force(3.0, 500.0),
        ProgramPoint::new(4.0, 0.0),
    ];
    for platens in [Platens::Sliding, Platens::Unilateral(Friction::none())] {
        for steps in [SegmentSteps::Fixed(3), SegmentSteps::default()] {
            let test = CompressionTest::following(program(&points), steps).platens(platens);
            let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
            let problem = test
                .builder(prism(2, false))
                .expect("platens")
                .order(Order::Linear)
                .materials([Material::hencky(275.0, 0.25)])
                .options(options)
                .build()
                .expect("a problem");
            let outcome = run(&problem);
            for point in &outcome.curve {
                let exact = elastic(point.displacement_mm);
                assert!((point.force_n - exact).abs() < 1e-6, "{platens:?} {point:?} {exact}");
            }
            let at = |time_s: f64| {
                let here = |p: &&CurvePoint| (p.time_s - time_s).abs() < 1e-9;
                *outcome.curve.iter().find(here).expect("a corner of the program")
            };
            for (time_s, force_n) in [(1.0, 800.0), (2.0, 800.0), (2.5, 100.0), (3.0, 500.0)] {
                assert!((at(time_s).force_n - force_n).abs() < 1e-5, "{:?}", at(time_s));
            }
            if steps == SegmentSteps::Fixed(3) {
                // force and displacement are linear between the corners, from the values that were reached
                let start = elastic(0.1);
                let third = start + (800.0 - start) / 3.0;
                assert!((at(0.5 + 0.5 / 3.0).force_n - third).abs() < 1e-5);
                let before_mm = at(3.0).displacement_mm;
                let half = at(3.0 + 1.0 / 3.0).displacement_mm;
                assert!((half - before_mm * 2.0 / 3.0).abs() < 1e-9, "{half} {before_mm}");
            }
            assert!(at(4.0).displacement_mm.abs() < 1e-12, "{:?}", at(4.0));
        }
    }
}

/// A force that increases beyond the largest force ends the run at the limit load, which is the peak of the test with
/// prescribed displacement.
#[test]
fn a_run_ends_at_its_limit_load() {
    let brittle = Material::hencky(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 0.0025,
        viscosity_mpa_s: 0.0,
        residual_stiffness: 0.01,
    });
    let problem = |points: &[ProgramPoint], steps| {
        CompressionTest::following(program(points), steps)
            .builder(prism(2, false))
            .expect("platens")
            .order(Order::Linear)
            .materials([brittle.clone()])
            .phase_field(phase_field(Split::None))
            .build()
            .expect("a problem")
    };
    let moved = problem(&[ProgramPoint::new(1.0, 0.12)], SegmentSteps::Fixed(240)).run(&mut ());
    let peak_n = moved.curve.iter().map(|p| p.force_n).fold(0.0, f64::max);
    assert!(moved.curve.last().expect("points").force_n < 0.9 * peak_n, "it softens");
    for steps in [SegmentSteps::Fixed(10), SegmentSteps::default()] {
        let loaded = problem(&[ProgramPoint::force(1.0, 2.0 * peak_n)], steps);
        let outcome = loaded.run(&mut ());
        assert!(matches!(outcome.end, End::LimitLoad), "{:?}", outcome.end);
        let last = outcome.curve.last().expect("points").force_n;
        println!("{steps:?}: {last} N of {peak_n} N, {:?}", outcome.effort);
        assert!(last < 1.001 * peak_n && last > 0.995 * peak_n, "{last} {peak_n}");
        assert!(outcome.effort.cuts < 40, "{:?}", outcome.effort);
    }
}

/// Observer that interrupts a run after some steps.
struct Kill(usize);

impl fem::Observer for Kill {
    fn step(&mut self, _: &CurvePoint, _: &Fields) -> ControlFlow<()> {
        self.0 -= 1;
        if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn a_resumed_run_with_prescribed_force_equals_the_uninterrupted_run_bit_for_bit() {
    let dir = tempfile::tempdir().expect("a directory");
    let points = [
        ProgramPoint::new(0.2, 0.02),
        ProgramPoint::force(0.5, 60.0),
        ProgramPoint::force(1.0, 60.0),
        ProgramPoint::new(1.2, 0.01),
    ];
    let young = MaterialParameter::new("young", 275.0, |x| {
        let elasticity = Material::hencky(x, 0.25).elasticity;
        vec![Material { elasticity, ..matrix() }, grain()]
    });
    let rough = Friction { coefficient: 0.1, ..Friction::none() };
    for (k, platens) in [Platens::Sliding, Platens::Unilateral(rough)].into_iter().enumerate() {
        let test =
            CompressionTest::following(program(&points), SegmentSteps::Fixed(5)).platens(platens);
        let field = Some(phase_field(Split::None));
        let mut problem = of_grains(&test, Order::Linear, LinearScheme::Direct, field);
        if platens == Platens::Sliding {
            problem = problem.with_sensitivities(vec![young.clone()]).expect("valid");
        }
        let whole = Checkpoint { path: dir.path().join(format!("whole-{k}")), every: 3 };
        let reference = problem.run_resumable(&whole, &mut ()).expect("no file is there");
        assert!(matches!(reference.end, End::Displacement), "{:?}", reference.end);
        let interrupted = Checkpoint { path: dir.path().join(format!("parts-{k}")), every: 3 };
        let outcome = loop {
            let outcome = problem.run_resumable(&interrupted, &mut Kill(7)).expect("a sound state");
            if !matches!(outcome.end, End::Interrupted) {
                break outcome;
            }
        };
        assert_eq!(outcome.curve, reference.curve);
        assert_eq!(outcome.fields, reference.fields);
        assert_eq!(outcome.sensitivities, reference.sensitivities);
    }
}

/// Derivatives of force and displacement along a program with both kinds of segments equal differences of runs.
#[test]
fn derivatives_with_prescribed_force_are_those_of_runs() {
    let points = [
        ProgramPoint::new(0.2, 0.02),
        ProgramPoint::force(0.5, 60.0),
        ProgramPoint::force(1.0, 60.0),
        ProgramPoint::new(1.2, 0.01),
    ];
    let test = CompressionTest::following(program(&points), SegmentSteps::Fixed(3));
    let brittle = |young: f64, toughness: f64| {
        let fracture = Fracture {
            toughness_n_per_mm: toughness,
            viscosity_mpa_s: 0.3,
            residual_stiffness: 0.01,
        };
        Material::hencky(young, 0.25).with_fracture(fracture)
    };
    let viscous = |young: f64| {
        let series = Viscoelasticity::shear([PronyTerm { fraction: FRACTION, time_s: TAU_S }]);
        Material::hencky(young, 0.25).with_viscoelasticity(series)
    };
    type Materials = Box<dyn Fn(f64) -> Vec<Material>>;
    let cases: [(&str, Option<PhaseField>, f64, Materials); 3] = [
        (
            "E",
            Some(phase_field(Split::None)),
            275.0,
            Box::new(move |x| vec![brittle(x, 0.0025), grain()]),
        ),
        (
            "Gc",
            Some(phase_field(Split::None)),
            0.0025,
            Box::new(move |x| vec![brittle(275.0, x), grain()]),
        ),
        ("E of a viscoelastic body", None, 275.0, Box::new(move |x| vec![viscous(x), grain()])),
    ];
    for (name, field, value, materials) in cases {
        for order in [Order::Linear, Order::Quadratic] {
            let options = SolverOptions {
                tolerance: 1e-12,
                linear_tolerance: 1e-6,
                linear: LinearScheme::Direct,
                ..SolverOptions::default()
            };
            let problem = test
                .builder(prism(2, true))
                .expect("platens")
                .order(order)
                .materials(materials(value))
                .phase_field(field)
                .options(options)
                .build()
                .expect("a problem");
            let parameter = MaterialParameter::new(name, value, &materials);
            let found = run(&problem.with_sensitivities(vec![parameter]).expect("valid"));
            let sensitivities = &found.sensitivities;
            assert_eq!(sensitivities.lost, None);
            assert_eq!(sensitivities.displacement_mm.len(), found.curve.len());
            let step = 1e-4 * value;
            let at = |x: f64| run(&problem.with_materials(materials(x)).expect("valid")).curve;
            let (above, below) = (at(value + step), at(value - step));
            let largest = |f: &dyn Fn(&CurvePoint) -> f64| {
                let pairs = above.iter().zip(&below);
                pairs.map(|(a, b)| ((f(a) - f(b)) / (2.0 * step)).abs()).fold(0.0, f64::max)
            };
            let (most_n, most_mm) = (largest(&|p| p.force_n), largest(&|p| p.displacement_mm));
            for (k, (a, b)) in above.iter().zip(&below).enumerate() {
                let force = (a.force_n - b.force_n) / (2.0 * step);
                let moved = (a.displacement_mm - b.displacement_mm) / (2.0 * step);
                let rates = [sensitivities.force_n[k][0], sensitivities.displacement_mm[k][0]];
                assert!(
                    (rates[0] - force).abs() < 2e-4 * most_n,
                    "{name} {order:?} {k}: {rates:?} {force}"
                );
                assert!(
                    (rates[1] - moved).abs() < 2e-4 * most_mm,
                    "{name} {order:?} {k}: {rates:?} {moved}"
                );
            }
        }
    }
}

#[test]
fn combinations_without_meaning_are_refused() {
    let force = program(&[ProgramPoint::force(1.0, 10.0)]);
    let rough = Platens::Unilateral(Friction::none());
    let test = CompressionTest::following(force, SegmentSteps::Fixed(1)).platens(rough);
    let problem = of_grains(&test, Order::Linear, LinearScheme::Direct, None);
    let young = MaterialParameter::new("young", 275.0, |x| {
        vec![Material { elasticity: Material::hencky(x, 0.25).elasticity, ..matrix() }, grain()]
    });
    let refused = problem.with_sensitivities(vec![young]).expect_err("contact has no derivatives");
    let reason = Unsupported::SensitivitiesOfForceByContact;
    assert!(matches!(&refused, FemError::Unsupported { reason: found, .. } if *found == reason));
    // conditions without the platen that the program drives
    let plain = CompressionTest::new(0.1, test.schedule.clone());
    let refused = plain.builder(prism(2, false)).expect("platens").materials([matrix()]).build();
    let reason = Unsupported::ForceWithoutPlaten;
    assert!(
        matches!(&refused, Err(FemError::Unsupported { reason: found, .. }) if *found == reason)
    );
    for (points, part) in [
        (vec![ProgramPoint::force(1.0, -1.0)], "a platen cannot pull"),
        (vec![ProgramPoint::force(1.0, f64::NAN)], "a platen cannot pull"),
        (vec![ProgramPoint::force(1.0, 0.0)], "positive (downwards)"),
    ] {
        let message = LoadProgram::new(points).expect_err("refused").to_string();
        assert!(message.contains(part), "{message}");
    }
}
