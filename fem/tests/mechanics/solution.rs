//! Solution of a run: schemes, steps, fallbacks, linear solvers, interruptions, threads.

use std::ops::ControlFlow;

use crate::support::{
    HEIGHT, RADIUS, grain, loading, matrix, peak, phase_field, prism, test, with_options,
};
use fem::{
    CompressionTest, CurvePoint, CylinderLattice, End, FemError, Fields, LinearScheme, Material,
    Order, Outcome, Progress, Schedule, Scheme, SolverOptions, Split, Step, StepController,
    StepFailure,
};

#[test]
fn alternate_minimisation_reaches_the_same_equilibrium() {
    let mesh = prism(2, true);
    let run = |scheme: Scheme, iterations: u32| {
        let options = SolverOptions { scheme, iterations, ..SolverOptions::default() };
        let field = phase_field(Split::None);
        let materials = vec![matrix(), grain()];
        with_options(
            mesh.clone(),
            Order::Linear,
            materials,
            Some(field),
            loading(0.2, 1.0, 20),
            options,
        )
        .expect("valid input")
        .run(&mut ())
    };
    let newton = run(Scheme::Monolithic, 30);
    let alternate = run(Scheme::Alternate, 30);
    // with a limit of three iterations, Newton's method fails in some steps, so that alternate minimisation or shorter
    // steps are necessary
    let helped = run(Scheme::Monolithic, 3);
    assert!(helped.effort.fallbacks > 0, "{:?}", helped.effort);
    assert_eq!((newton.effort.fallbacks, newton.effort.cuts), (0, 0));
    for outcome in [&alternate, &helped] {
        assert_eq!(outcome.curve.len(), 20, "{:?}", outcome.end);
        for (a, b) in newton.curve.iter().zip(&outcome.curve) {
            // if steps were reduced, the error of the time integration differs slightly
            let tolerance = if outcome.effort.cuts > 0 { 2e-2 } else { 1e-6 };
            assert!(
                (a.force_n - b.force_n).abs() < tolerance * a.force_n,
                "{a:?}\n{b:?}\n{:?}",
                outcome.effort
            );
        }
    }
}

#[test]
fn failed_steps_are_reduced_and_the_requested_points_are_reached() {
    // four iterations often fail and one alternation never converges, so that only shorter steps converge
    let options = SolverOptions { iterations: 4, alternations: 1, ..SolverOptions::default() };
    let test = with_options(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.12, 1.0, 2),
        options,
    )
    .expect("valid input");
    let outcome = test.run(&mut ());
    assert!(outcome.effort.cuts > 0, "{:?}", outcome.effort);
    let displacements: Vec<f64> = outcome.curve.iter().map(|p| p.displacement_mm).collect();
    assert_eq!(displacements, [0.06, 0.12], "{:?}", outcome.end);
}

#[test]
fn adaptive_steps_reach_the_peak_and_stop_below_it() {
    let adaptive = CompressionTest::new(0.3, Schedule::adaptive(1.5).stop_below_peak(0.1));
    let make = |loading| {
        test(
            prism(2, true),
            Order::Linear,
            vec![matrix(), grain()],
            Some(phase_field(Split::None)),
            loading,
            1e-8,
        )
    };
    let outcome = make(adaptive).run(&mut ());
    assert!(matches!(outcome.end, End::BelowPeak), "{:?}", outcome.end);
    let last = outcome.curve.last().expect("points");
    let highest = outcome.curve.iter().map(|p| p.force_n).fold(0.0, f64::max);
    assert!(
        last.force_n < 0.9 * highest
            && outcome.curve[outcome.curve.len() - 2].force_n >= 0.9 * highest
    );
    assert!(
        outcome.curve[1].displacement_mm - outcome.curve[0].displacement_mm
            > outcome.curve[0].displacement_mm,
        "steps grow"
    );
    let fixed = make(loading(0.3, 1.5, 400)).run(&mut ());
    let (fine, coarse) = (peak(&fixed), highest);
    assert!((coarse - fine.1).abs() < 0.02 * fine.1, "{coarse} and {fine:?}");
}

#[test]
fn multigrid_and_the_sparse_factor_agree_beyond_the_peak() {
    for order in [Order::Linear, Order::Quadratic] {
        let [direct, multigrid] = [LinearScheme::Direct, LinearScheme::Multigrid].map(|linear| {
            let options = SolverOptions { linear, ..SolverOptions::default() };
            let test = with_options(
                prism(3, true),
                order,
                vec![matrix(), grain()],
                Some(phase_field(Split::None)),
                loading(0.3, 1.0, 30),
                options,
            );
            let outcome = test.expect("valid input").run(&mut ());
            assert!(matches!(outcome.end, End::Displacement), "{linear:?}: {:?}", outcome.end);
            outcome
        });
        let (_, highest) = peak(&direct);
        assert!(direct.curve.last().expect("a point").force_n < 0.8 * highest, "past the peak");
        for (a, b) in direct.curve.iter().zip(&multigrid.curve) {
            assert!((a.force_n - b.force_n).abs() < 1e-6 * highest, "{order:?}: {a:?} {b:?}");
        }
    }
}

/// Returns the outcome of one step of a cylinder with stiff patches.
fn patched_cylinder(spacing_mm: f64, order: Order, linear: LinearScheme) -> Outcome {
    let lattice = CylinderLattice { radius_mm: RADIUS, height_mm: HEIGHT, spacing_mm };
    let mut mesh = lattice.build().expect("a mesh");
    mesh.regions.push("grain".into());
    for tet in 0..mesh.tets.len() {
        let [x, y, z] = mesh.corners(tet)[0];
        mesh.region_of[tet] = u16::from((1.9 * x).sin() * (2.1 * y).cos() * (1.7 * z).sin() > 0.4);
    }
    let options = SolverOptions { linear, ..SolverOptions::default() };
    let field = Some(phase_field(Split::None));
    let materials = vec![matrix(), grain()];
    with_options(mesh, order, materials, field, loading(0.02, 1.0, 1), options)
        .expect("valid input")
        .run(&mut ())
}

#[test]
fn multigrid_iterations_do_not_depend_on_the_mesh_size() {
    for (order, spacings) in [(Order::Linear, [0.9, 0.55]), (Order::Quadratic, [1.4, 0.9])] {
        let [coarse, fine] = spacings.map(|spacing_mm| {
            let outcome = patched_cylinder(spacing_mm, order, LinearScheme::Multigrid);
            assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
            f64::from(outcome.effort.linear) / f64::from(outcome.effort.iterations)
        });
        assert!(fine < coarse + 6.0 && fine < 30.0, "{order:?}: {coarse} and {fine} iterations");
    }
}

#[test]
fn threads_change_no_bit_of_a_solution() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            [
                patched_cylinder(0.7, Order::Linear, LinearScheme::Direct),
                patched_cylinder(0.7, Order::Linear, LinearScheme::Multigrid),
                // more nodes than a parallel task processes, so that several threads work
                patched_cylinder(0.7, Order::Quadratic, LinearScheme::Multigrid),
            ]
            .map(|outcome| (outcome.curve, outcome.fields))
        })
    };
    let alone = run(1);
    assert!(alone[2].1.damage.len() > 4096, "{} nodes", alone[2].1.damage.len());
    assert!(alone == run(2) && alone == run(3), "threads change a solution");
}

#[test]
fn a_user_defined_controller_gets_failures_and_chooses_the_steps() {
    #[derive(Debug)]
    struct Thirds;
    impl StepController for Thirds {
        fn next(&self, run: &Progress) -> Option<Step> {
            match (run.failed, run.taken) {
                (Some(failed), _) => Some(Step::Advance(failed.fraction() / 3.0)),
                (None, Some(taken)) => {
                    assert!((run.moved - taken.fraction()).abs() < 1e-12, "{run:?}");
                    Some(taken)
                }
                (None, None) => Some(Step::Advance(0.3)),
            }
        }
    }
    let problem = |schedule: Schedule, options: SolverOptions| {
        with_options(
            prism(2, true),
            Order::Linear,
            vec![matrix(), grain()],
            Some(phase_field(Split::None)),
            CompressionTest::new(0.12, schedule),
            options,
        )
        .expect("valid input")
    };
    // with few iterations and one alternation, the first step fails, and the controller reduces it to a third
    let options = SolverOptions { iterations: 4, alternations: 1, ..SolverOptions::default() };
    let outcome = problem(Schedule::new(1.0, Thirds), options).run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    assert!(outcome.effort.cuts > 0, "{:?}", outcome.effort);
    let first = outcome.curve[0].displacement_mm / 0.12;
    let cuts = (0.3 / first).ln() / 3f64.ln();
    assert!(cuts > 0.9 && (cuts - cuts.round()).abs() < 1e-9, "{first} of the displacement");

    #[derive(Debug)]
    struct Always(Option<Step>);
    impl StepController for Always {
        fn next(&self, _: &Progress) -> Option<Step> {
            self.0
        }
    }
    let refused = |step: Option<Step>, part: &str| {
        let schedule = Schedule::new(1.0, Always(step));
        let outcome = problem(schedule, SolverOptions::default()).run(&mut ());
        let End::Failed(error) = outcome.end else { panic!("{:?}", outcome.end) };
        assert!(error.to_string().contains(part), "{error}");
    };
    refused(None, "the step controller ended the run");
    refused(Some(Step::Advance(-0.1)), "step = -0.1 must be positive");
    refused(Some(Step::Release { n_mm: 1.0, guess: 0.1 }), "controls_crack_energy");
}

#[test]
fn a_failed_run_returns_its_curve_and_the_reason() {
    let options = SolverOptions {
        iterations: 1,
        alternations: 1,
        tolerance: 1e-13,
        ..SolverOptions::default()
    };
    let test = with_options(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.2, 1.0, 4),
        options,
    )
    .expect("valid input");
    let mut run = test.start();
    while run.step().is_some() {}
    assert!(run.step().is_none(), "the run has ended");
    let outcome = run.finish();
    let End::Failed(error) = &outcome.end else { panic!("{:?}", outcome.end) };
    let FemError::NotConverged { source, step_s, .. } = error else { panic!("{error}") };
    let (StepFailure::TooManyIterations { iterations, residual }
    | StepFailure::Stalled { iterations, residual }) = *source
    else {
        panic!("{source}")
    };
    assert!(iterations >= 1 && residual > 0.0, "{source}");
    assert!(*step_s < 1e-6, "cut down to {step_s} s");
    assert!(error.to_string().contains("no equilibrium"), "{error}");
    let reason = std::error::Error::source(error).map(|source| source.is::<StepFailure>());
    assert_eq!(reason, Some(true), "the reason is kept as it is");
    assert!(outcome.curve.len() < 4);
}

#[test]
fn an_observer_gets_every_point_and_can_interrupt() {
    let test =
        test(prism(1, false), Order::Linear, vec![matrix()], None, loading(0.2, 1.0, 10), 1e-8);
    let mut seen = Vec::new();
    let outcome = test.run(&mut |point: &CurvePoint, fields: &Fields| {
        assert_eq!(fields.displacement.len(), 8);
        seen.push(*point);
        if seen.len() == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(outcome.end, End::Interrupted));
    assert_eq!(outcome.curve, seen);
}

#[test]
fn a_loop_over_the_steps_of_a_stepper_gives_the_outcome_of_run() {
    let test = test(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.1, 1.0, 6),
        1e-8,
    );
    let whole = test.run(&mut ());
    let mut run = test.start();
    assert!(run.fields().damage.iter().all(|phi| *phi == 0.0) && run.curve().is_empty());
    let mut taken = 0;
    while let Some(point) = run.step() {
        assert_eq!(point, whole.curve[taken]);
        taken += 1;
        assert_eq!(run.curve().len(), taken);
    }
    assert_eq!(run.effort(), whole.effort);
    let outcome = run.finish();
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    assert_eq!((taken, outcome.fields), (6, whole.fields));
    // the caller finishes this run before its end
    let mut early = test.start();
    early.step().expect("an equilibrium");
    assert!(matches!(early.finish().end, End::Interrupted));
}

#[test]
fn other_materials_share_the_discretisation_and_threads_change_nothing() {
    let base = test(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.2, 1.0, 10),
        1e-8,
    );
    let stiffer = Material { elasticity: Material::hencky(290.0, 0.25).elasticity, ..matrix() };
    let other = base.with_materials(vec![stiffer.clone(), grain()]).expect("valid materials");
    let fresh = test(
        prism(2, true),
        Order::Linear,
        vec![stiffer, grain()],
        Some(phase_field(Split::None)),
        loading(0.2, 1.0, 10),
        1e-8,
    );
    let [a, b, c] = std::thread::scope(|scope| {
        let runs = [&other, &other, &fresh].map(|test| scope.spawn(|| test.run(&mut ())));
        runs.map(|run| run.join().expect("a run"))
    });
    assert_eq!(a.curve, b.curve);
    assert_eq!(a.curve, c.curve);
    assert_eq!(a.fields, c.fields);
    let elastic = base
        .with_materials(vec![matrix(), Material { fracture: None, ..grain() }])
        .expect("valid materials");
    assert!(elastic.unknowns() < base.unknowns(), "the grains' inner nodes lose their damage");
}
