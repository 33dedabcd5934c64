//! Findings on curves of a closed form.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// Closed form of viscous damage: 44 steps to 0.22 mm, peak 147 N at 0.12 mm.
fn viscous() -> TestCurve {
    let displacement_mm: Vec<f64> = (0..=44).map(|i| 0.005 * f64::from(i)).collect();
    let force =
        |u: f64| 147.0 * (1.0_f64 / 3.0).exp() * (u / 0.12) * (-(u / 0.12_f64).powi(3) / 3.0).exp();
    let force_n = displacement_mm.iter().map(|&u| force(u)).collect();
    TestCurve::new(displacement_mm, force_n)
}

fn changed(change: impl Fn(&mut Vec<f64>, &mut Vec<f64>)) -> TestCurve {
    let mut curve = viscous();
    change(&mut curve.displacement_mm, &mut curve.force_n);
    curve
}

/// Returns the names of the findings that are warnings or errors, and whether each is a warning or
/// an error.
fn found(curve: &TestCurve) -> Vec<(&'static str, Weight)> {
    let findings = InspectedCurve::of(curve, 0.3).findings;
    findings.iter().filter(|f| f.weight != Weight::Note).map(|f| (f.name, f.weight)).collect()
}

#[test]
fn a_sound_curve_has_a_toe_of_nothing_and_no_other_finding() {
    for fraction in [0.3, 0.55] {
        let seen = InspectedCurve::of(&viscous(), fraction);
        assert_eq!(seen.findings.iter().map(|f| f.name).collect::<Vec<_>>(), ["toe"]);
        assert!(seen.toe_mm.abs() < 0.004 * 0.12, "{}", seen.toe_mm);
    }
}

#[test]
fn what_makes_quantities_wrong_is_an_error_of_its_own_name() {
    use Weight::Error;
    let minus = |x: &mut Vec<f64>| x.iter_mut().for_each(|x| *x = -*x);
    let cases: [(TestCurve, &str); 9] = [
        (changed(|u, _| minus(u)), "sign-of-displacement"),
        (changed(|_, f| minus(f)), "sign-of-force"),
        (changed(|u, f| (u.reverse(), f.reverse()).0), "order"),
        (changed(std::mem::swap), "columns-swapped"),
        (changed(|u, f| (u.swap(6, 15), f.swap(6, 15)).0), "order"),
        (changed(|_, f| f[24] = 190.0), "spike"),
        (changed(|u, _| u.fill(0.1)), "displacement"),
        (changed(|u, f| (u.truncate(20), f.truncate(20)).0), "no-quantities"),
        (changed(|_, f| f[5..10].reverse()), "slope"),
    ];
    for (curve, name) in cases {
        let found = found(&curve);
        assert!(found.contains(&(name, Error)), "{name}: {found:?}");
    }
}

#[test]
fn preload_spikes_unloading_and_sparse_readings_are_told() {
    use Weight::Warning;
    let loaded = changed(|u, f| {
        u.drain(..4);
        f.drain(..4);
        let first = u[0];
        u.iter_mut().for_each(|u| *u -= first);
    });
    assert_eq!(found(&loaded), [("preload", Warning), ("toe", Warning)]);
    assert_eq!(found(&changed(|_, f| f[12] -= 30.0)), [("spike", Warning)]);
    let unloaded = changed(|u, f| {
        u.extend([0.2, 0.15, 0.1, 0.036]);
        f.extend([50.0, 20.0, 1.0, 0.0]);
    });
    assert_eq!(found(&unloaded), [("unloading", Warning)]);
    assert_eq!(InspectedCurve::of(&unloaded, 0.3).prepared, viscous());
    let sparse = changed(|u, f| {
        let mut kept = 0..;
        u.retain(|_| kept.next().is_some_and(|i| i % 3 == 0));
        let mut kept = 0..;
        f.retain(|_| kept.next().is_some_and(|i| i % 3 == 0));
    });
    assert_eq!(found(&sparse), [("sampling", Warning)]);
}

/// The limit of a toe is 2 % of the displacement at peak: 2 % of 0.12 mm are 0.0024 mm. The toe is determined to within
/// 0.0005 mm.
#[test]
fn a_toe_is_a_warning_from_two_percent_of_the_displacement_at_peak_on() {
    let late = |toe: f64| changed(|u, _| u.iter_mut().for_each(|u| *u += toe));
    assert_eq!(found(&late(0.0018)), []);
    assert_eq!(found(&late(0.0032)), [("toe", Weight::Warning)]);
    assert_eq!(found(&late(-0.0018)), []);
    assert_eq!(found(&late(-0.0032)), [("toe", Weight::Warning)]);
    let finding = &InspectedCurve::of(&late(0.0032), 0.3).findings[0];
    assert!(finding.problem.contains(" % of its displacement at peak"), "{finding:?}");
}

/// Soft start of a = 0.02 mm. The force at displacement u is the closed form at a displacement v that solves u = v + a
/// (1 − e^(−v/(0.2 a))).
#[test]
fn a_soft_start_is_measured_and_taken_away() {
    let a = 0.02;
    let soft = changed(|u, _| {
        u.iter_mut().for_each(|u| *u += a * (1.0 - (-*u / (0.2 * a)).exp()));
    });
    assert_eq!(found(&soft), [("toe", Weight::Warning)]);
    let (corrected, moved) = InspectedCurve::of(&soft, 0.3).without_toe(0.3);
    assert!((moved / a - 1.0).abs() < 0.05, "{moved} mm");
    let [exact, with, without] =
        [&viscous(), &soft, &corrected].map(|curve| Qois::of(curve, 0.3).unwrap());
    let error = |q: &Qois| q.displacement_at_peak_mm / exact.displacement_at_peak_mm - 1.0;
    assert!(error(&with) > 0.15 && error(&without).abs() < 0.01, "{with:?} {without:?}");
    assert!((without.slope_n_per_mm / exact.slope_n_per_mm - 1.0).abs() < 0.01);
}

/// `n` readings of the viscous curve. Force and displacement have normal noise with standard deviations of `noise_n`
/// (N) and `noise_mm` (mm).
fn dense(n: u32, noise_n: f64, noise_mm: f64, seed: u64) -> TestCurve {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let force =
        |u: f64| 147.0 * (1.0_f64 / 3.0).exp() * (u / 0.12) * (-(u / 0.12_f64).powi(3) / 3.0).exp();
    let exact: Vec<f64> = (0..n).map(|i| 0.19 * f64::from(i) / f64::from(n)).collect();
    TestCurve {
        force_n: exact.iter().map(|&u| force(u) + noise_n * normal.sample(&mut rng)).collect(),
        displacement_mm: exact.iter().map(|u| u + noise_mm * normal.sample(&mut rng)).collect(),
        ..TestCurve::default()
    }
}

/// Noise of 3 N and 1 µm is reported neither as spikes nor as a wrong order.
#[test]
fn noise_of_force_and_displacement_is_no_fault_of_single_readings() {
    for seed in 0..10 {
        for (n, noise_n, noise_mm) in
            [(4000, 3.0, 0.0), (20_000, 3.0, 0.001), (4000, 1.0, 0.001), (200, 1.0, 0.001)]
        {
            let curve = dense(n, noise_n, noise_mm, seed);
            // the toe is omitted: noise of 200 readings changes the toe by more than 2 % of the displacement at peak
            let faults: Vec<_> = found(&curve).into_iter().filter(|f| f.0 != "toe").collect();
            assert_eq!(faults, [], "{n} {noise_n} {noise_mm} {seed}");
        }
    }
}

/// For forty spikes of 40 N in noise of 3 N, five spikes are listed, then the number of the other
/// spikes.
#[test]
fn many_spikes_are_five_examples_and_a_count() {
    let mut curve = dense(4000, 3.0, 0.0, 1);
    (0..40).for_each(|i| curve.force_n[100 + 20 * i] += 40.0);
    let findings = InspectedCurve::of(&curve, 0.3).findings;
    let spikes: Vec<_> = findings.iter().filter(|finding| finding.name == "spike").collect();
    assert_eq!(spikes.len(), 6);
    assert!(spikes[5].problem.contains("35 further readings"), "{}", spikes[5].problem);
}

/// The displacements of rows in random order scatter by a third of their range, which is too much for noise.
#[test]
fn shuffled_rows_are_a_wrong_order() {
    let curve = changed(|u, f| {
        for i in 0..u.len() {
            let other = (i * i * 7 + 13) % u.len();
            u.swap(i, other);
            f.swap(i, other);
        }
    });
    assert_eq!(found(&curve).first().map(|f| f.1), Some(Weight::Error), "{:?}", found(&curve));
}

#[test]
fn a_load_cell_that_was_not_zeroed_is_an_error() {
    let pulled = changed(|_, f| f.iter_mut().for_each(|f| *f -= 20.0));
    assert!(found(&pulled).contains(&("force-zero", Weight::Error)), "{:?}", found(&pulled));
    let noisy = TestCurve { force_n: dense(4000, 3.0, 0.0, 2).force_n, ..dense(4000, 3.0, 0.0, 2) };
    assert!(!found(&noisy).iter().any(|f| f.0 == "force-zero"));
}

/// Two curves with a late loading: the first displacement is 0.3 mm, or the platen travels 0.3 mm before contact.
#[test]
fn loading_that_begins_late_is_named_and_corrected_on_request() {
    let offset = changed(|u, _| u.iter_mut().for_each(|u| *u += 0.3));
    let approach = changed(|u, f| {
        u.iter_mut().for_each(|u| *u += 0.3);
        u.splice(0..0, (0..60).map(|i| 0.005 * f64::from(i)));
        f.splice(0..0, (0..60).map(|i| 0.2 * f64::from(i % 3)));
    });
    let exact = Qois::of(&viscous(), 0.3).unwrap();
    for curve in [offset, approach] {
        let seen = InspectedCurve::of(&curve, 0.3);
        let names: Vec<_> = found(&curve).iter().map(|f| f.0).collect();
        assert_eq!(names.first(), Some(&"late-load"), "{names:?}");
        assert!(!names.contains(&"no-quantities"), "{names:?}");
        let (corrected, moved_mm) = seen.without_toe(0.3);
        let qois = Qois::of(&corrected, 0.3).unwrap();
        assert!((moved_mm - 0.3).abs() < 0.001, "{moved_mm}");
        let ratio = qois.displacement_at_peak_mm / exact.displacement_at_peak_mm;
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }
}

/// A ramp to 0.1 mm in 1 s, a hold of 4 s with relaxation to 60 %, and unloading in 1 s, from 2 s on. Displacement and force
/// have normal noise with standard deviations of 0.02 µm and 0.05 N.
fn ramp_hold_unload(compliance: f64) -> TestCurve {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let time: Vec<f64> = (0..=120).map(|i| 0.05 * f64::from(i)).collect();
    let exact = |t: f64| match t {
        t if t <= 1.0 => (0.1 * t, 100.0 * t),
        t if t <= 5.0 => (0.1, 60.0 + 40.0 * (-(t - 1.0)).exp()),
        t => (0.1 * (6.0 - t), 60.0 * (6.0 - t)),
    };
    let force_n: Vec<f64> =
        time.iter().map(|&t| exact(t).1 + 0.05 * normal.sample(&mut rng)).collect();
    // the crosshead follows the program; the displacement of the specimen is smaller
    let displacement_mm =
        time.iter().map(|&t| exact(t).0 + 2e-5 * normal.sample(&mut rng)).collect();
    let time_s = time.iter().map(|t| t + 2.0).collect();
    let record = TestCurve { time_s, ..TestCurve::new(displacement_mm, force_n) };
    let machine = Machine { compliance_mm_per_n: compliance, force_offset_n: 0.0 };
    machine.specimen(&record)
}

fn of_ramp_hold_unload(needs_peak: bool) -> CheckedProgram {
    let segment = |end_s, mm| ProgramSegment { end_s, end: ProgramLoad::Displacement(mm) };
    CheckedProgram {
        segments: vec![segment(1.0, 0.1), segment(5.0, 0.1), segment(6.0, 0.0)],
        needs_peak,
    }
}

#[test]
fn a_record_of_a_program_keeps_hold_and_unloading() {
    use crate::branch::BranchKind::{Hold, Loading, Unloading};
    let rigid = Machine::default();
    let seen = InspectedCurve::of_program(
        &ramp_hold_unload(0.0),
        &rigid,
        0.3,
        &of_ramp_hold_unload(false),
    );
    assert_eq!(seen.findings, []);
    let branches: Vec<_> =
        seen.prepared.branches.iter().map(|b| (b.kind, b.readings.start)).collect();
    assert_eq!(branches.iter().map(|b| b.0).collect::<Vec<_>>(), [Loading, Hold, Unloading]);
    for ((_, start), exact) in branches.iter().zip([0, 20, 100_usize]) {
        assert!(start.abs_diff(exact) <= 1, "{branches:?}");
    }
    assert_eq!((seen.prepared.time_s[0], seen.prepared.time_s[20]), (0.0, 1.0));
    // without a peak, quantities of the peak cannot be computed
    let with_peak = of_ramp_hold_unload(true);
    let peak = InspectedCurve::of_program(&ramp_hold_unload(0.0), &rigid, 0.3, &with_peak);
    assert_eq!(
        peak.findings.iter().map(|f| (f.name, f.weight)).collect::<Vec<_>>(),
        [("no-quantities", Weight::Error)]
    );
    // a compliant machine: the specimen is compressed further during the hold, but the branch still
    // counts as a hold
    let machine = Machine { compliance_mm_per_n: 1e-4, force_offset_n: 0.0 };
    let seen = InspectedCurve::of_program(
        &ramp_hold_unload(0.0),
        &machine,
        0.3,
        &of_ramp_hold_unload(false),
    );
    let kinds: Vec<_> = seen.prepared.branches.iter().map(|b| b.kind).collect();
    assert_eq!(kinds, [Loading, Hold, Unloading]);
    assert_eq!(seen.prepared.displacement_mm, ramp_hold_unload(1e-4).displacement_mm);
}

#[test]
fn a_program_needs_times_that_increase() {
    let name = |curve: &TestCurve| {
        let seen = InspectedCurve::of_program(
            curve,
            &Machine::default(),
            0.3,
            &of_ramp_hold_unload(false),
        );
        assert_eq!(seen.findings.len(), 1, "{:?}", seen.findings);
        (seen.findings[0].name, seen.findings[0].weight)
    };
    let curve = ramp_hold_unload(0.0);
    let timeless = TestCurve { time_s: Vec::new(), ..curve.clone() };
    assert_eq!(name(&timeless), ("no-time", Weight::Error));
    let mut twice = curve;
    twice.time_s[7] = twice.time_s[6];
    assert_eq!(name(&twice), ("time", Weight::Error));
}
