//! Derivatives of runs whose laws have a state or whose damage minimises no energy, against differences of whole runs.

use super::sensitivity::{
    Case, Named, all, assert_differences, case, differentiated, forces, named,
};
use crate::support::creeping::{CREEPING, Creeping, creeping};
use crate::support::{loading, phase_field};
use fem::{
    Axis, Conditions, CrackDensity, Irreversibility, Material, Mixture, Order, PhaseField, Problem,
    Split,
};

const HISTORY: Irreversibility = Irreversibility::History;

/// Returns the problem with compression to 0.1 mm, unloading to 0.04 mm, and compression to 0.2 mm.
fn back_and_on(problem: &Problem) -> Problem {
    let down = |time_s: f64| match time_s {
        t if t < 0.4 => 0.25 * t,
        t if t < 0.6 => 0.1 - 0.3 * (t - 0.4),
        t => 0.04 + 0.4 * (t - 0.6),
    };
    let conditions = Conditions::new()
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, -down(time_s)])
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, -1.0]);
    problem.with_conditions(conditions).expect("valid")
}

/// A case in which the tolerance of the alternations is so small that differences of runs have five correct
/// digits.
fn accurate(order: Order, field: PhaseField) -> Case {
    let mut case = case(order, field);
    case.options.alternations = 4000;
    case.options.tolerance = 1e-11;
    case.loading = loading(0.2, 1.0, 10);
    case
}

fn some(names: &[&str]) -> Vec<Named> {
    all().into_iter().filter(|of| names.contains(&of.name)).collect()
}

#[test]
fn a_history_is_differentiated_while_it_unloads() {
    let field = PhaseField { irreversibility: HISTORY, ..phase_field(Split::None) };
    let problem = back_and_on(&accurate(Order::Linear, field).of_grains());
    let free = back_and_on(&accurate(Order::Linear, phase_field(Split::None)).of_grains());
    // during unloading, the history determines the damage
    let (kept, free) = (forces(&problem), forces(&free));
    assert!((kept[5] / free[5] - 1.0).abs() > 0.01, "{kept:?} {free:?}");
    let names = ["young", "toughness", "viscosity", "poisson"];
    assert_differences(&problem, &some(&names), "history");

    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let young = some(&["young"]);
    let rows = |threads| {
        let pool = pool(threads).expect("threads");
        pool.install(|| differentiated(&problem, &young).sensitivities.force_n)
    };
    assert_eq!(rows(1), rows(3));
}

#[test]
fn histories_of_other_elements_splits_and_solvers_are_differentiated() {
    let field = PhaseField { irreversibility: HISTORY, ..phase_field(Split::VolumetricDeviatoric) };
    let quadratic = back_and_on(&accurate(Order::Quadratic, field).of_grains());
    assert_differences(&quadratic, &some(&["young", "toughness"]), "quadratic");

    let mut mixed = accurate(Order::Linear, field);
    let fractions = mixed.mesh.region_of.iter().enumerate().map(|(tet, &region)| {
        let fraction = if region == 0 { [0.0, 0.3, 0.7][tet % 3] } else { 0.0 };
        Mixture { fraction, ..Mixture::default() }
    });
    mixed.mesh.mixture = Some(fractions.collect());
    let mixed = back_and_on(&mixed.of_grains());
    assert_differences(&mixed, &some(&["young", "grain_young"]), "mixtures");

    let at1 = PhaseField { model: CrackDensity::At1, irreversibility: HISTORY, ..field };
    let multigrid = back_and_on(&accurate(Order::Linear, at1).multigrid().of_grains());
    assert_differences(&multigrid, &some(&["viscosity"]), "multigrid");
}

#[test]
fn a_hybrid_split_is_differentiated() {
    let field = PhaseField { hybrid: true, split: Split::Spectral, ..PhaseField::new(0.06) };
    let problem = accurate(Order::Linear, field).of_grains();
    assert_differences(&problem, &some(&["young", "toughness"]), "hybrid");
}

/// The matrix creeps and breaks, and the grains are elastic, so that elements with and without a state are in the same
/// SIMD vector.
#[test]
fn a_law_with_a_state_is_differentiated() {
    let parameters = [
        named("bulk", CREEPING.bulk_mpa, |bulk_mpa| creeping(Creeping { bulk_mpa, ..CREEPING })),
        named("time", CREEPING.time_s, |time_s| creeping(Creeping { time_s, ..CREEPING })),
        named("toughness", 0.0025, |x| {
            let [mut matrix, grain] = <[Material; 2]>::try_from(creeping(CREEPING)).expect("two");
            matrix.fracture.as_mut().expect("it breaks").toughness_n_per_mm = x;
            vec![matrix, grain]
        }),
    ];
    for order in [Order::Linear, Order::Quadratic] {
        let mut case = accurate(order, phase_field(Split::None));
        case.options.tolerance = 1e-12;
        let problem = back_and_on(&case.problem(creeping(CREEPING)));
        assert_differences(&problem, &parameters, &format!("{order:?}"));
    }
    let with_history = PhaseField { irreversibility: HISTORY, ..phase_field(Split::None) };
    let problem = back_and_on(&accurate(Order::Linear, with_history).problem(creeping(CREEPING)));
    assert_differences(&problem, &parameters[..2], "with a history");
}
