//! Curves of runs on several ranks. In these tests, the ranks are threads instead of processes.

use crate::support::column::column;
use crate::support::{grain, loading, matrix, peak, phase_field, prism};
use fem::{
    ArcLength, Axis, CompressionTest, Conditions, CurvePoint, Fracture, Friction, Interface,
    Irreversibility, LinearScheme, LoadProgram, Material, Order, Outcome, PhaseField, Platens,
    Problem, ProgramPoint, Ranks, Schedule, SegmentSteps, SolverOptions, Split, TetMesh,
};

pub(crate) fn multigrid() -> SolverOptions {
    SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() }
}

/// Options with linear solutions so accurate that rounding errors hardly change the number of Newton iterations.
fn careful() -> SolverOptions {
    SolverOptions { linear_tolerance: 1e-3, ..multigrid() }
}

pub(crate) fn problem(
    mesh: TetMesh,
    order: Order,
    loading: &CompressionTest,
    options: SolverOptions,
    ranks: Ranks,
) -> Problem {
    loading
        .builder(mesh)
        .expect("a specimen")
        .order(order)
        .materials([matrix(), grain()])
        .phase_field(phase_field(Split::None))
        .options(options)
        .ranks(ranks)
        .build()
        .expect("valid input")
}

/// Calls `work` on every rank, each on a thread, and returns the results.
pub(crate) fn on_ranks<T: Send>(count: usize, work: impl Fn(Ranks) -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let work = &work;
        let threads: Vec<_> = Ranks::threads(count)
            .into_iter()
            .map(|ranks| scope.spawn(move || work(ranks)))
            .collect();
        threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
    })
}

pub(crate) fn assert_same(alone: &Outcome, shared: &Outcome) {
    let highest = alone.curve.iter().map(|point| point.force_n).fold(0.0, f64::max);
    assert_eq!(alone.curve.len(), shared.curve.len(), "{:?}", shared.end);
    let energy = alone.curve.iter().map(|p| p.work_n_mm).fold(0.0, f64::max);
    for (a, b) in alone.curve.iter().zip(&shared.curve) {
        assert!((a.force_n - b.force_n).abs() < 1e-6 * highest, "{a:?} {b:?}");
        for (a, b) in [
            (a.elastic_n_mm, b.elastic_n_mm),
            (a.fracture_n_mm, b.fracture_n_mm),
            (a.viscous_n_mm, b.viscous_n_mm),
            (a.work_n_mm, b.work_n_mm),
        ] {
            assert!((a - b).abs() < 1e-6 * energy, "{a} {b}");
        }
        assert!((a.phi_mean - b.phi_mean).abs() < 1e-6 && (a.phi_max - b.phi_max).abs() < 1e-5);
    }
    assert_eq!(alone.fields.damage.len(), shared.fields.damage.len());
    for (a, b) in alone.fields.displacement.iter().zip(&shared.fields.displacement) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-5), "{a:?} {b:?}");
    }
}

#[test]
fn any_number_of_ranks_takes_the_same_steps_beyond_the_peak() {
    let sliding = Platens::Sliding;
    // with less friction, a body that lifts off from platens can break in several ways, and rounding errors decide
    // whether Newton's method converges
    let rough = Platens::Unilateral(Friction { coefficient: 0.3, ..Friction::none() });
    for (order, platens, counts) in [
        (Order::Quadratic, sliding, &[2, 3, 4][..]),
        (Order::Quadratic, rough, &[3]),
        (Order::Linear, sliding, &[4]),
    ] {
        let loading = loading(0.3, 1.0, 20).platens(platens);
        let run =
            |ranks: Ranks| problem(prism(3, true), order, &loading, careful(), ranks).run(&mut ());
        let alone = run(Ranks::default());
        let last = alone.curve.last().expect("a point").force_n;
        assert!(last < 0.8 * peak(&alone).1, "{order:?}: {last}");
        for &count in counts {
            let all = on_ranks(count, run);
            for shared in &all {
                assert_same(&alone, shared);
                // the results are bitwise equal on every rank
                assert_eq!(shared.curve, all[0].curve);
                assert_eq!(shared.fields.damage, all[0].fields.damage);
            }
            let (a, b) = (alone.effort, all[0].effort);
            println!("{order:?}, {count} ranks: {b:?} after {a:?}");
            // because of rounding errors, a residual may be just above or just below the tolerance
            assert!(a.iterations.abs_diff(b.iterations) <= 1 + a.iterations / 100, "{a:?} {b:?}");
            assert!(f64::from(b.linear) < 1.2 * f64::from(a.linear), "{a:?} {b:?}");
        }
    }
}

/// Arc-length steps follow a snap-back; their constraint must be equal on all ranks.
#[test]
fn ranks_follow_a_snap_back_together() {
    let run = |ranks: Ranks| {
        let elastic = Material::hencky(100.0, 0.0);
        let weak = elastic.clone().with_fracture(Fracture::new(0.1));
        let steps = ArcLength { step: 0.02, release_n_mm: 2e-3 };
        CompressionTest::new(1.0, Schedule::new(1.0, steps).stop_below_peak(0.8))
            .builder(column())
            .expect("a column")
            .materials([weak, elastic])
            .phase_field(PhaseField {
                irreversibility: Irreversibility::ActiveSet,
                ..PhaseField::new(1.0)
            })
            .options(multigrid())
            .ranks(ranks)
            .build()
            .expect("valid input")
            .run(&mut ())
    };
    let alone = run(Ranks::default());
    let travel = |pair: &[CurvePoint]| pair[1].displacement_mm - pair[0].displacement_mm;
    assert!(alone.curve.windows(2).any(|pair| travel(pair) < 0.0), "it snaps back");
    on_ranks(3, run).iter().for_each(|shared| assert_same(&alone, shared));
}

/// A prescribed force and dead pressures give the same displacements on any number of ranks.
#[test]
fn ranks_carry_a_prescribed_force_together() {
    let points = vec![
        ProgramPoint::force(0.5, 90.0),
        ProgramPoint::force(1.0, 90.0),
        ProgramPoint::new(1.2, 0.02),
    ];
    let program = LoadProgram::new(points).expect("a program");
    let rough = Platens::Unilateral(Friction { coefficient: 0.3, ..Friction::none() });
    for (order, platens) in [
        (Order::Quadratic, Platens::Sliding),
        (Order::Linear, Platens::Sliding),
        (Order::Linear, rough),
    ] {
        let loading = CompressionTest::following(program.clone(), SegmentSteps::Fixed(3));
        let loading = loading.platens(platens);
        let run =
            |ranks: Ranks| problem(prism(3, true), order, &loading, careful(), ranks).run(&mut ());
        let alone = run(Ranks::default());
        assert!(alone.curve[5].displacement_mm > alone.curve[2].displacement_mm, "it creeps");
        for shared in on_ranks(3, run) {
            assert_same(&alone, &shared);
            for (a, b) in alone.curve.iter().zip(&shared.curve) {
                assert!((a.displacement_mm / b.displacement_mm - 1.0).abs() < 1e-6, "{a:?} {b:?}");
            }
        }
    }
}

/// The sums of surface loads and of body loads over the ranks do not depend on the partition.
#[test]
fn loads_do_not_depend_on_the_parts() {
    let run = |ranks: Ranks| {
        let conditions = Conditions::new()
            .fix("bottom", Axis::ALL)
            .traction("top", |x, time_s| [0.1 * time_s, 0.0, -2.0 * x[0] * time_s])
            .pressure("top", |x, time_s| 0.3 * x[1] * time_s)
            .body_force(|x, time_s| [0.0, 0.05 * x[2] * time_s, 0.0])
            .measure("top", [0.0, 0.0, -1.0]);
        let problem = Problem::builder(prism(3, false))
            .order(Order::Quadratic)
            .materials([Material::hencky(275.0, 0.25)])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, 2))
            .options(multigrid())
            .ranks(ranks)
            .build()
            .expect("valid input");
        problem.run(&mut ())
    };
    let alone = run(Ranks::default());
    assert!(alone.curve[1].displacement_mm > 1e-2, "{:?}", alone.curve);
    for shared in on_ranks(4, run) {
        for (a, b) in alone.curve.iter().zip(&shared.curve) {
            assert!((a.displacement_mm - b.displacement_mm).abs() < 1e-7 * a.displacement_mm);
            assert!((a.work_n_mm - b.work_n_mm).abs() < 1e-7 * a.work_n_mm);
        }
        for (a, b) in alone.fields.displacement.iter().zip(&shared.fields.displacement) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-6), "{a:?} {b:?}");
        }
    }
}

#[test]
fn interface_bands_are_divided_among_the_ranks() {
    for order in [Order::Linear, Order::Quadratic] {
        let run = |ranks: Ranks| {
            let problem = loading(0.2, 1.0, 10)
                .builder(prism(3, true))
                .expect("a specimen")
                .order(order)
                .materials([matrix(), grain()])
                .phase_field(phase_field(Split::None))
                .interfaces([Interface::new(["matrix", "grain"], 0.0005, 1.0)])
                .options(careful())
                .ranks(ranks)
                .build()
                .expect("valid input");
            problem.run(&mut ())
        };
        let alone = run(Ranks::default());
        on_ranks(3, run).iter().for_each(|shared| assert_same(&alone, shared));
    }
}
