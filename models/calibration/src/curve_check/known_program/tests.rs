//! Branches of curves in closed form, with noise, few and many readings, and machines that depart from their program.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::super::{CheckedProgram, InspectedCurve, Weight};
use super::*;
use crate::branch::BranchKind::{ForceHold, Hold, Loading, Unloading};
use crate::machine::Machine;
use crate::qoi::{CreepDisplacement, Qois, Quantity, RelaxedFraction};
use ProgramLoad::{Displacement, Force};

/// A test with its response in closed form.
struct Closed {
    name: &'static str,
    program: Vec<ProgramSegment>,
    kinds: &'static [BranchKind],
    /// Displacement (mm) and force (N) at a time (s) after the start of the program.
    response: fn(f64) -> (f64, f64),
}

fn program(points: &[(f64, ProgramLoad)]) -> Vec<ProgramSegment> {
    points.iter().map(|&(end_s, end)| ProgramSegment { end_s, end }).collect()
}

/// Value at a time of the piecewise linear function through (0, 0) and the given points.
fn linear(points: &[(f64, f64)], time_s: f64) -> f64 {
    let mut before = (0.0, 0.0);
    for &(end_s, end) in points {
        if time_s <= end_s {
            let part = ((time_s - before.0) / (end_s - before.0)).max(0.0);
            return before.1 + part * (end - before.1);
        }
        before = (end_s, end);
    }
    before.1
}

/// Sum over the corners of a piecewise linear input of the response to a ramp of unit rate that starts at the corner.
fn superposed(points: &[(f64, f64)], ramp: impl Fn(f64) -> f64, time_s: f64) -> f64 {
    let (mut before, mut rate, mut sum) = ((0.0, 0.0), 0.0, 0.0);
    for &(end_s, end) in points {
        let next = (end - before.1) / (end_s - before.0);
        sum += (next - rate) * ramp((time_s - before.0).max(0.0));
        (before, rate) = ((end_s, end), next);
    }
    sum
}

/// Relaxation of a standard linear solid: moduli of 800 and 500 N/mm, relaxation time 1.3 s.
fn relaxing(points: &[(f64, f64)], time_s: f64) -> f64 {
    superposed(points, |t| 800.0 * t + 500.0 * 1.3 * (1.0 - (-t / 1.3).exp()), time_s)
}

/// Creep of a standard linear solid: compliances of 1e-3 and 5e-4 mm/N, retardation time 2 s.
fn creeping(points: &[(f64, f64)], time_s: f64) -> f64 {
    superposed(points, |t| 1e-3 * t + 5e-4 * (t - 2.0 * (1.0 - (-t / 2.0).exp())), time_s)
}

const RELAXATION: [(f64, f64); 3] = [(1.0, 0.1), (11.0, 0.1), (12.0, 0.0)];
const CREEP: [(f64, f64); 3] = [(1.0, 80.0), (11.0, 80.0), (13.0, 10.0)];
const CYCLES: [(f64, f64); 5] = [(2.0, 0.08), (3.0, 0.03), (5.0, 0.12), (6.0, 0.06), (8.0, 0.15)];
const FORCE_CYCLES: [(f64, f64); 5] =
    [(1.0, 60.0), (2.0, 20.0), (4.0, 90.0), (5.0, 30.0), (9.0, 30.0)];

/// Creep at 80 N, and an unloading in displacement whose force falls faster than its displacement.
fn creep_and_return(time_s: f64) -> (f64, f64) {
    let reached = creeping(&CREEP, 11.0);
    match time_s <= 11.0 {
        true => (creeping(&CREEP, time_s), linear(&CREEP, time_s)),
        false => {
            let part = (1.0 - (time_s - 11.0) / 2.0).max(0.0);
            (reached * part, 80.0 * part.powf(1.6))
        }
    }
}

fn tests() -> Vec<Closed> {
    let displacements = |points: &[(f64, f64)]| {
        program(&points.iter().map(|&(t, u)| (t, Displacement(u))).collect::<Vec<_>>())
    };
    let forces = |points: &[(f64, f64)]| {
        program(&points.iter().map(|&(t, f)| (t, Force(f))).collect::<Vec<_>>())
    };
    vec![
        Closed {
            name: "hold of the displacement",
            program: displacements(&RELAXATION),
            kinds: &[Loading, Hold, Unloading],
            response: |t| (linear(&RELAXATION, t), relaxing(&RELAXATION, t)),
        },
        Closed {
            name: "hold of the force",
            program: forces(&CREEP),
            kinds: &[Loading, ForceHold, Unloading],
            response: |t| (creeping(&CREEP, t), linear(&CREEP, t)),
        },
        Closed {
            name: "hold of the force and unloading in displacement",
            program: program(&[(1.0, Force(80.0)), (11.0, Force(80.0)), (13.0, Displacement(0.0))]),
            kinds: &[Loading, ForceHold, Unloading],
            response: creep_and_return,
        },
        Closed {
            name: "cycles",
            program: displacements(&CYCLES),
            kinds: &[Loading, Unloading, Loading, Unloading, Loading],
            response: |t| (linear(&CYCLES, t), relaxing(&CYCLES, t)),
        },
        Closed {
            name: "cycles of the force",
            program: forces(&FORCE_CYCLES),
            kinds: &[Loading, Unloading, Loading, Unloading, ForceHold],
            response: |t| (creeping(&FORCE_CYCLES, t), linear(&FORCE_CYCLES, t)),
        },
        Closed {
            name: "elastic creep test",
            program: forces(&CREEP),
            kinds: &[Loading, ForceHold, Unloading],
            response: |t| (1e-3 * linear(&CREEP, t), linear(&CREEP, t)),
        },
    ]
}

/// Times of readings from the start to the end of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sampling {
    Equal,
    /// Uniformly distributed times.
    Random,
    /// Each segment has the same number of readings.
    BySegment,
}

impl Sampling {
    fn times(self, corners_s: &[f64], n: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let end_s = corners_s[corners_s.len() - 1];
        let mut times: Vec<f64> = match self {
            Self::Equal => (0..n).map(|i| end_s * i as f64 / (n - 1) as f64).collect(),
            Self::Random => {
                let inner = (0..n - 2).map(|_| end_s * rng.random::<f64>());
                [0.0, end_s].into_iter().chain(inner).collect()
            }
            Self::BySegment => {
                let each = n / (corners_s.len() - 1);
                let inside = |pair: &[f64]| {
                    let (from, to) = (pair[0], pair[1]);
                    (0..each).map(move |i| from + (to - from) * i as f64 / each as f64)
                };
                corners_s.windows(2).flat_map(inside).chain([end_s]).collect()
            }
        };
        times.sort_by(f64::total_cmp);
        times
    }
}

fn corners_s(program: &[ProgramSegment]) -> Vec<f64> {
    [0.0].into_iter().chain(program.iter().map(|segment| segment.end_s)).collect()
}

/// Readings at the given times. The standard deviation of the noise is `noise` times the largest value.
fn measured(
    response: impl Fn(f64) -> (f64, f64),
    times: &[f64],
    noise: f64,
    rng: &mut Xoshiro256PlusPlus,
) -> TestCurve {
    let (mut u, mut f): (Vec<f64>, Vec<f64>) = times.iter().map(|&t| response(t)).unzip();
    let normal = Normal::new(0.0, 1.0).unwrap();
    for values in [&mut u, &mut f] {
        let sd = noise * values.iter().copied().fold(0.0, f64::max);
        values.iter_mut().for_each(|x| *x += sd * normal.sample(rng));
    }
    TestCurve { time_s: times.to_vec(), ..TestCurve::new(u, f) }
}

/// The curve as the checks of measured curves prepare it. No check may be an error.
fn prepared(curve: &TestCurve, program: &[ProgramSegment]) -> TestCurve {
    let program = CheckedProgram { segments: program.to_vec(), needs_peak: false };
    let seen = InspectedCurve::of_program(curve, &Machine::default(), 0.3, &program);
    let errors = seen.findings.iter().filter(|finding| finding.weight == Weight::Error);
    assert_eq!(errors.count(), 0, "{:?}", seen.findings);
    seen.prepared
}

#[test]
fn noise_and_sampling_do_not_change_the_branches() {
    for test in tests() {
        for (noise, n, sampling, seed) in [0.0, 0.001, 0.005, 0.02]
            .iter()
            .flat_map(|&noise| [40, 150, 4000].map(|n| (noise, n)))
            .flat_map(|(noise, n)| {
                [Sampling::Equal, Sampling::Random, Sampling::BySegment].map(|s| (noise, n, s))
            })
            .flat_map(|(noise, n, s)| (0..4).map(move |seed| (noise, n, s, seed)))
        {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let corners_s = corners_s(&test.program);
            let times = sampling.times(&corners_s, n, &mut rng);
            let mut curve = measured(test.response, &times, noise, &mut rng);
            // the clock of the machine does not start with the test
            curve.time_s.iter_mut().for_each(|t| *t += 3.25);
            let branches = prepared(&curve, &test.program).branches;
            let place = format!("{}: noise {noise}, {n} readings, {sampling:?}, {seed}", test.name);
            let kinds: Vec<BranchKind> = branches.iter().map(|b| b.kind).collect();
            assert_eq!(kinds, test.kinds, "{place}: {branches:?}");
            for (k, (branch, corner_s)) in branches.iter().zip(&corners_s).enumerate() {
                // the first reading of the branch is the first reading after the corner; an earlier reading is allowed
                // only within the tolerance of the corner
                let start_s = times[branch.readings.start];
                let neighbours = &corners_s[k.saturating_sub(1)..(k + 2).min(corners_s.len())];
                let shortest_s = neighbours
                    .windows(2)
                    .map(|pair| pair[1] - pair[0])
                    .fold(f64::INFINITY, f64::min);
                let is_at_corner = (start_s - corner_s).abs() <= super::AT_CORNER * shortest_s;
                let between =
                    times.iter().filter(|t| (**t - corner_s) * (**t - start_s) < -1e-9).count();
                assert!(is_at_corner || between == 0, "{place}: {start_s} {corner_s} {branches:?}");
            }
        }
    }
}

/// The creep displacement and the relaxed fraction have their closed forms, within the noise of their readings.
#[test]
fn quantities_of_noisy_holds_are_those_of_the_closed_form() {
    let tests = tests();
    let exact = creeping(&CREEP, 11.0) - creeping(&CREEP, 1.0);
    let relaxed = 1.0 - relaxing(&RELAXATION, 11.0) / relaxing(&RELAXATION, 1.0);
    for noise in [0.0, 0.005, 0.02] {
        for seed in 0..20 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(100 + seed);
            let mut value = |test: &Closed, quantity: Quantity| {
                let times = Sampling::BySegment.times(&corners_s(&test.program), 300, &mut rng);
                let curve = measured(test.response, &times, noise, &mut rng);
                Qois::values_of(&prepared(&curve, &test.program), 0.3, &[quantity]).unwrap()[0]
            };
            // the standard deviation of the difference of a reading and of the end of a parabola through ten readings
            let sd = noise * (1.0_f64 + 0.62).sqrt();
            let found = value(&tests[1], Quantity::new(CreepDisplacement));
            let largest = creeping(&CREEP, 11.0);
            assert!((found - exact).abs() < 5.0 * sd * largest + 1e-6, "{noise} {seed}: {found}");
            let found = value(&tests[0], Quantity::new(RelaxedFraction));
            assert!((found - relaxed).abs() < 5.0 * sd + 1e-4, "{noise} {seed}: {found} {relaxed}");
        }
    }
}

/// A record that begins after the test has started, or while the machine still rests.
#[test]
fn the_start_of_the_program_is_found_in_the_readings() {
    for test in tests() {
        let corners_s = corners_s(&test.program);
        for (offset_s, noise) in [-0.4, 0.0, 0.6].iter().flat_map(|&o| [0.0, 0.01].map(|s| (o, s)))
        {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
            let end_s = corners_s[corners_s.len() - 1] + offset_s;
            let times: Vec<f64> = (0..=600).map(|i| end_s * f64::from(i) / 600.0).collect();
            let moved = |t: f64| (test.response)((t - offset_s).max(0.0));
            let curve = measured(moved, &times, noise, &mut rng);
            let branches = prepared(&curve, &test.program).branches;
            let place = format!("{}: {offset_s} s, noise {noise}: {branches:?}", test.name);
            let rest = usize::from(offset_s > 0.0);
            let kinds: Vec<BranchKind> = branches.iter().map(|b| b.kind).collect();
            assert_eq!(kinds[rest..], *test.kinds, "{place}");
            for (branch, corner_s) in branches[rest..].iter().zip(&corners_s) {
                let exact_s = (corner_s + offset_s).max(0.0);
                let off_s = (times[branch.readings.start] - exact_s).abs();
                assert!(off_s < 0.1 * 0.6 + 0.03, "{place}: {off_s} s at {corner_s} s");
            }
        }
    }
}

/// A machine that reaches each corner late, by a different time.
#[test]
fn corners_move_to_the_readings_of_a_slow_machine() {
    const LATE: [(f64, f64); 3] = [(1.15, 80.0), (11.4, 80.0), (13.0, 10.0)];
    let test = &tests()[1];
    for (noise, most) in [(0.0, 1), (0.005, 4), (0.02, 12)] {
        for seed in 0..10 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let times: Vec<f64> = (0..=650).map(|i| 0.02 * f64::from(i)).collect();
            let response = |t: f64| (creeping(&LATE, t), linear(&LATE, t));
            let curve = measured(response, &times, noise, &mut rng);
            let branches = prepared(&curve, &test.program).branches;
            let starts: Vec<usize> = branches.iter().map(|b| b.readings.start).collect();
            for (start, (corner_s, _)) in starts[1..].iter().zip(LATE) {
                let exact = times.partition_point(|t| *t < corner_s);
                assert!(start.abs_diff(exact) <= most, "{noise} {seed}: {branches:?}");
            }
        }
    }
}

#[test]
fn a_curve_that_ends_early_has_the_branches_that_it_reaches() {
    let test = &tests()[1];
    let times: Vec<f64> = (0..=50).map(|i| 0.1 * f64::from(i)).collect();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let curve = measured(test.response, &times, 0.01, &mut rng);
    let branches = prepared(&curve, &test.program).branches;
    let expected = [(Loading, 0..11), (ForceHold, 10..51)];
    let expected = expected.map(|(kind, readings)| Branch { kind, readings });
    assert_eq!(branches, expected);
    let within_loading = measured(test.response, &times[..8], 0.01, &mut rng);
    assert_eq!(prepared(&within_loading, &test.program).branches, []);
}

/// A ramp that is shorter than the time between two readings.
#[test]
fn a_ramp_without_readings_does_not_hide_the_hold() {
    let program = program(&[(0.1, Force(80.0)), (10.0, Force(80.0))]);
    let times: Vec<f64> = (0..=40).map(|i| 0.25 * f64::from(i)).collect();
    let points = [(0.1, 80.0), (10.0, 80.0)];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let response = |t: f64| (creeping(&points, t), linear(&points, t));
    let curve = measured(response, &times, 0.0, &mut rng);
    let seen = prepared(&curve, &program);
    let expected = [(Loading, 0..2), (ForceHold, 1..41)];
    assert_eq!(seen.branches, expected.map(|(kind, readings)| Branch { kind, readings }));
    let quantity = Quantity::new(CreepDisplacement);
    let found = Qois::values_of(&seen, 0.3, &[quantity]).unwrap()[0];
    let exact = creeping(&points, 10.0) - creeping(&points, 0.25);
    assert!((found - exact).abs() < 1e-4 * exact, "{found} {exact}");
}
