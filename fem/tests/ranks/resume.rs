//! Checkpoints of several ranks, ranks that end, and unsupported settings.

use std::ops::ControlFlow;

use crate::curve::{assert_same, multigrid, on_ranks, problem};
use crate::support::creeping::{CREEPING, creeping};
use crate::support::{grain, loading, matrix, phase_field, prism};
use fem::{
    Checkpoint, CurvePoint, End, FemError, Fields, Friction, Irreversibility, LawState,
    LinearScheme, Material, MaterialParameter, Order, Outcome, PhaseField, Platens, Problem, Ranks,
    SolverOptions, Split,
};

/// Returns a problem with a state that is carried from step to step: a history at quadrature points, or bounds at nodes.
fn with_memory(irreversibility: Irreversibility, platens: Platens, ranks: Ranks) -> Problem {
    let field = PhaseField { irreversibility, ..phase_field(Split::None) };
    loading(0.2, 1.0, 8)
        .platens(platens)
        .builder(prism(2, true))
        .expect("a specimen")
        .order(Order::Quadratic)
        .materials([matrix(), grain()])
        .phase_field(field)
        .options(multigrid())
        .ranks(ranks)
        .build()
        .expect("valid input")
}

/// Observer that ends a run after `steps` steps.
fn until(steps: usize) -> impl FnMut(&CurvePoint, &Fields) -> ControlFlow<()> {
    let mut left = steps;
    move |_: &CurvePoint, _: &Fields| {
        left -= 1;
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn a_run_of_two_ranks_resumes_on_three_ranks_and_on_one_rank() {
    let friction =
        Friction { coefficient: 0.1, slip_velocity_mm_per_s: 0.05, drag_mpa_s_per_mm: 0.0 };
    for (irreversibility, platens) in [
        (Irreversibility::History, Platens::Sliding),
        (Irreversibility::ActiveSet, Platens::Unilateral(friction)),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let checkpoint = |name: &str| Checkpoint { path: folder.path().join(name), every: 1 };
        let run = |ranks: Ranks, name: &str, steps: usize| {
            let problem = with_memory(irreversibility, platens, ranks);
            problem.run_resumable(&checkpoint(name), &mut until(steps)).expect("a state")
        };
        let alone = run(Ranks::default(), "alone", 100);
        let begun = on_ranks(2, |ranks| run(ranks, "shared", 4));
        assert!(begun.iter().all(|o| o.curve.len() == 4 && matches!(o.end, End::Interrupted)));
        std::fs::copy(folder.path().join("shared"), folder.path().join("again")).expect("a copy");
        let mut gone_on = on_ranks(3, |ranks| run(ranks, "shared", 100));
        gone_on.push(run(Ranks::default(), "again", 100));
        for shared in &gone_on {
            assert_same(&alone, shared);
            assert_same_contact(&alone, shared);
        }
    }
}

/// The stress of a law with a state needs the state at the start of the last increment, of all ranks.
#[test]
fn the_stress_of_a_law_with_a_state_does_not_depend_on_the_ranks() {
    let folder = tempfile::tempdir().expect("a folder");
    let checkpoint = |name: &str| Checkpoint { path: folder.path().join(name), every: 1 };
    let problem = |ranks: Ranks| {
        let materials = creeping(CREEPING).into_iter().map(|m| Material { fracture: None, ..m });
        loading(0.1, 1.0, 4)
            .builder(prism(2, true))
            .expect("a specimen")
            .materials(materials.collect::<Vec<_>>())
            .options(multigrid())
            .ranks(ranks)
            .build()
            .expect("valid input")
    };
    let run = |ranks: Ranks, name: &str, steps: usize| {
        let resumed = problem(ranks).run_resumable(&checkpoint(name), &mut until(steps));
        resumed.expect("a state").fields
    };
    let whole = problem(Ranks::default());
    let stresses = |fields: &Fields| whole.evaluate(fields).and_then(|state| state.elements());
    let alone = stresses(&run(Ranks::default(), "alone", 100)).expect("the fields of the problem");
    let elastic = Fields { state: LawState::default(), ..whole.run(&mut ()).fields };
    let elastic = stresses(&elastic).expect("the fields of the problem");
    assert!((alone[0].stress_mpa[2] / elastic[0].stress_mpa[2] - 1.0).abs() > 0.01);
    on_ranks(2, |ranks| run(ranks, "shared", 2));
    for fields in on_ranks(3, |ranks| run(ranks, "shared", 100)) {
        let shared = stresses(&fields).expect("the fields of the problem");
        assert_eq!(alone.len(), shared.len());
        for (a, b) in alone.iter().zip(&shared) {
            let (a, b) = (a.stress_mpa[2], b.stress_mpa[2]);
            assert!((a - b).abs() < 1e-5 * a.abs(), "{a} {b}");
        }
    }
}

fn assert_same_contact(alone: &Outcome, shared: &Outcome) {
    assert_eq!(alone.contact.len(), shared.contact.len());
    for (surface, contact_points) in &alone.contact {
        let others = &shared.contact[surface];
        assert_eq!(contact_points.len(), others.len());
        let most = contact_points.iter().map(|p| p.pressure_mpa).fold(0.0, f64::max);
        for (a, b) in contact_points.iter().zip(others) {
            assert_eq!((a.node, a.area_mm2), (b.node, b.area_mm2));
            assert!((a.pressure_mpa - b.pressure_mpa).abs() < 1e-4 * most, "{a:?} {b:?}");
        }
    }
    for (surface, forces) in &alone.reactions {
        let last = |forces: &[[f64; 3]]| forces.last().expect("a step")[2];
        let (a, b) = (last(forces), last(&shared.reactions[surface]));
        assert!((a - b).abs() < 1e-5 * a.abs(), "{surface}: {a} {b}");
    }
}

#[test]
fn if_a_rank_ends_the_error_of_the_others_names_the_checkpoint() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.state");
    let ends = on_ranks(3, |ranks| {
        let gone = ranks.rank() == 2;
        let problem =
            problem(prism(2, true), Order::Linear, &loading(0.3, 1.0, 12), multigrid(), ranks);
        let checkpoint = Checkpoint { path: path.clone(), every: 2 };
        let mut run = problem.resume(&checkpoint).expect("a start");
        for step in 1.. {
            if gone && step == 6 {
                return None;
            }
            if run.step().is_some() {
                assert!(step < 6);
                continue;
            }
            let outcome = run.finish();
            assert_eq!((outcome.curve.len(), outcome.fields.damage.len()), (5, 27));
            let End::Failed(error @ FemError::RankLost { .. }) = outcome.end else {
                panic!("{:?}", outcome.end)
            };
            return Some(error.to_string());
        }
        None
    });
    for end in &ends[..2] {
        let end = end.as_deref().expect("an error");
        assert!(end.contains("rank 2 has ended") && end.contains("run.state"), "{end}");
    }
    let alone = problem(
        prism(2, true),
        Order::Linear,
        &loading(0.3, 1.0, 12),
        multigrid(),
        Ranks::default(),
    );
    let checkpoint = Checkpoint { path: path.clone(), every: 2 };
    let run = alone.resume(&checkpoint).expect("the state is valid");
    assert_eq!(run.curve().len(), 4);

    let ends = on_ranks(2, |ranks| {
        let gone = ranks.rank() == 1;
        let problem =
            problem(prism(2, true), Order::Linear, &loading(0.3, 1.0, 12), multigrid(), ranks);
        (!gone).then(|| {
            let mut run = problem.start();
            assert!(run.step().is_none());
            let End::Failed(error) = run.finish().end else { panic!("rank 1 has ended") };
            error.to_string()
        })
    });
    let end = ends[0].as_deref().expect("an error");
    assert!(end.contains("rank 1 has ended") && end.contains("no state was saved"), "{end}");
}

#[test]
fn a_state_that_cannot_be_written_or_read_ends_all_ranks() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| Checkpoint { path: folder.path().join(name), every: 1 };
    std::fs::write(folder.path().join("damaged"), "no state").expect("a file");
    let ends = on_ranks(2, |ranks| {
        let problem =
            problem(prism(2, true), Order::Linear, &loading(0.1, 1.0, 4), multigrid(), ranks);
        let outcome = problem.run_resumable(&at("no/folder"), &mut ()).expect("a start");
        let End::Failed(unwritten) = outcome.end else { panic!("{:?}", outcome.end) };
        let damaged = problem.resume(&at("damaged")).expect_err("no state");
        (unwritten.to_string(), damaged.to_string())
    });
    for (unwritten, damaged) in &ends {
        assert!(unwritten.contains("no/folder"), "{unwritten}");
        assert!(damaged.contains("damaged"), "{damaged}");
    }
    assert!(ends[1].0.contains("rank 0"), "{}", ends[1].0);
}

#[test]
fn settings_that_need_one_process_are_rejected() {
    let refused = |change: &dyn Fn(fem::ProblemBuilder) -> fem::ProblemBuilder, cells: usize| {
        let ranks = Ranks::threads(7).swap_remove(0);
        let builder = loading(0.1, 1.0, 1).builder(prism(cells, false)).expect("a specimen");
        let builder = builder.materials([matrix()]).phase_field(PhaseField::new(0.06)).ranks(ranks);
        change(builder).build().map(drop).expect_err("refused").to_string()
    };
    let direct = SolverOptions { linear: LinearScheme::Direct, ..SolverOptions::default() };
    let text = refused(&|builder| builder.options(direct), 2);
    assert!(text.contains("7 ranks") && text.contains("multigrid"), "{text}");
    let text = refused(&|builder| builder, 1);
    assert!(text.contains("fewer elements"), "{text}");

    let ends = on_ranks(2, |ranks| {
        let problem =
            problem(prism(2, true), Order::Linear, &loading(0.1, 1.0, 1), multigrid(), ranks);
        let young = MaterialParameter::new("young_mpa", 275.0, |x| {
            vec![Material { ..matrix() }, Material::hencky(x, 0.25)]
        });
        problem.with_sensitivities(vec![young]).expect_err("refused").to_string()
    });
    assert!(ends[0].contains("derivatives"), "{}", ends[0]);
}
