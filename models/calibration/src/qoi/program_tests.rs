//! Quantities of curves with hold, unloading and reloading, compared with closed forms.

use approx::assert_relative_eq;

use super::definition::Qoi;
use super::{
    ForceAtTime, HysteresisEnergy, PeakedCurve, QoiError, Qois, Quantity, RelaxedFraction,
    UnloadingSlope,
};
use crate::branch::BranchKind;
use crate::experiment::TestCurve;

/// Readings of a program from (0 s, 0 mm) through the points (s, mm), `n` per segment, with the force of `force`.
fn curve(program: &[(f64, f64)], n: usize, force: impl Fn(f64, f64) -> f64) -> TestCurve {
    let mut curve =
        TestCurve { time_s: vec![0.0], ..TestCurve::new(vec![0.0], vec![force(0.0, 0.0)]) };
    let mut before = (0.0, 0.0);
    for &(time_s, u) in program {
        for i in 1..=n {
            let part = i as f64 / n as f64;
            let [t, x] = [before.0 + part * (time_s - before.0), before.1 + part * (u - before.1)];
            curve.time_s.push(t);
            curve.displacement_mm.push(x);
            curve.force_n.push(force(t, x));
        }
        before = (time_s, u);
    }
    curve.with_branches(1e-9)
}

fn at(seconds: f64) -> Quantity {
    let name = toml::Value::from(format!("force-at-{seconds}-s"));
    name.try_into().expect("the name of a quantity")
}

fn value(curve: &TestCurve, quantity: impl Qoi) -> Result<f64, QoiError> {
    Ok(Qois::values_of(curve, 0.3, &[Quantity::new(quantity)])?[0])
}

/// Constants of a standard linear solid: F = k∞ u + f, ḟ = k₁ u̇ − f/τ.
const REST: f64 = 800.0;
const MAXWELL: f64 = 500.0;
const TAU_S: f64 = 1.3;
/// A ramp to 0.1 mm in 0.4 s, a hold until 6.4 s, and unloading in 0.4 s.
const PROGRAM: [(f64, f64); 3] = [(0.4, 0.1), (6.4, 0.1), (6.8, 0.0)];

/// Force of the standard linear solid in [`PROGRAM`], with the Maxwell stiffness `maxwell`.
fn solid(maxwell: f64) -> impl Fn(f64, f64) -> f64 {
    let speed = 0.1 / 0.4;
    // Maxwell force f of a ramp that starts at t = 0. The program is the sum of this ramp, of the reversed ramp from
    // 0.4 s on, and of the reversed ramp from 6.4 s on
    let ramp = move |t: f64| match t > 0.0 {
        true => maxwell * speed * TAU_S * (1.0 - (-t / TAU_S).exp()),
        false => 0.0,
    };
    move |t, u| REST * u + ramp(t) - ramp(t - 0.4) - (ramp(t - 6.4))
}

#[test]
fn force_and_relaxed_fraction_are_those_of_the_standard_linear_solid() {
    let force = solid(MAXWELL);
    let curve = curve(&PROGRAM, 200, &force);
    for seconds in [0.2, 0.4, 0.5, 2.0, 6.4, 6.7] {
        let u =
            if seconds <= 0.4 { 0.25 * seconds } else { 0.1 - 0.25 * (seconds - 6.4_f64).max(0.0) };
        let found = Qois::values_of(&curve, 0.3, &[at(seconds)]).unwrap()[0];
        assert_relative_eq!(found, force(seconds, u), max_relative = 1e-5);
    }
    let [start, end] = [force(0.4, 0.1), force(6.4, 0.1)];
    let found = value(&curve, RelaxedFraction).unwrap();
    assert_relative_eq!(found, 1.0 - end / start, max_relative = 1e-4);
    assert!((0.2..0.4).contains(&found), "{found}");
}

/// Loading with the stiffness k to u, unloading with the stiffness k₂ to u/2: the slope is k₂, and the dissipated
/// work is k u²/2 − (k u² /2 − k₂ u²/8).
#[test]
fn slope_and_energy_of_an_unloading_are_exact_for_straight_branches() {
    let (k, k2, u) = (1500.0, 2600.0, 0.04);
    let force = |t: f64, x: f64| if t <= 1.0 { k * x } else { k * u - k2 * (u - x) };
    // a hold between loading and unloading does not change the results
    for program in
        [&[(1.0, u), (1.5, 0.5 * u)][..], &[(1.0, u), (3.0, u), (4.0, 0.5 * u), (5.0, 0.5 * u)]]
    {
        for n in [5, 40] {
            let curve = curve(program, n, force);
            assert_relative_eq!(value(&curve, UnloadingSlope).unwrap(), k2, max_relative = 1e-9);
            let returned = 0.5 * u * (k * u - 0.25 * k2 * u);
            let lost = 0.5 * k * u * u - returned;
            assert_relative_eq!(
                value(&curve, HysteresisEnergy).unwrap(),
                lost,
                max_relative = 1e-9
            );
        }
    }
    let elastic = curve(&[(1.0, u), (2.0, 0.0)], 10, |_, x| k * x);
    assert!(value(&elastic, HysteresisEnergy).unwrap().abs() < 1e-12 * k * u * u);
}

#[test]
fn derivatives_are_those_of_the_values() {
    let quantities = [
        at(0.2),
        at(3.0),
        Quantity::new(RelaxedFraction),
        Quantity::new(UnloadingSlope),
        Quantity::new(HysteresisEnergy),
    ];
    let values = |maxwell: f64| {
        Qois::values_of(&curve(&PROGRAM, 30, solid(maxwell)), 0.3, &quantities).unwrap()
    };
    let step = 1e-3;
    let [below, above] = [MAXWELL - step, MAXWELL + step];
    // the force is linear in the Maxwell stiffness
    let [at_zero, at_one] = [0.0, 1.0].map(|maxwell| curve(&PROGRAM, 30, solid(maxwell)).force_n);
    let rates: Vec<f64> = at_one.iter().zip(&at_zero).map(|(one, zero)| one - zero).collect();
    let curve = curve(&PROGRAM, 30, solid(MAXWELL));
    let found = Qois::rates_of(&curve, 0.3, &quantities, &rates).unwrap();
    for (k, rate) in found.iter().enumerate() {
        let difference = (values(above)[k] - values(below)[k]) / (2.0 * step);
        assert_relative_eq!(*rate, difference, max_relative = 1e-6);
    }
}

/// Loading interrupted by unloading and a hold: the peak equals the peak of the loading without
/// interruption.
#[test]
fn quantities_of_the_peak_leave_out_unloading_and_reloading() {
    let envelope = |x: f64| 1500.0 * x * (-(x / 0.12_f64).powi(3) / 3.0).exp();
    let straight = curve(&[(2.0, 0.2)], 200, |_, x| envelope(x));
    assert!(straight.branches.is_empty());
    // unloading from 0.08 mm to 0.06 mm below the envelope, a hold, and reloading
    let force = |t: f64, x: f64| match t {
        t if (0.8..=1.4).contains(&t) => envelope(0.08) - 4000.0 * (0.08 - x),
        _ => envelope(x),
    };
    let program = [(0.8, 0.08), (1.0, 0.06), (1.2, 0.06), (1.4, 0.08), (2.6, 0.2)];
    let interrupted = curve(&program, 100, force);
    let kinds: Vec<BranchKind> = interrupted.branches.iter().map(|b| b.kind).collect();
    use BranchKind::{Hold, Loading, Unloading};
    assert_eq!(kinds, [Loading, Unloading, Hold, Loading]);
    let [a, b] = [&straight, &interrupted].map(|curve| Qois::of(curve, 0.3).unwrap());
    assert_relative_eq!(a.peak_force_n, b.peak_force_n, max_relative = 1e-4);
    assert_relative_eq!(a.displacement_at_peak_mm, b.displacement_at_peak_mm, max_relative = 1e-3);
    assert_relative_eq!(a.slope_n_per_mm, b.slope_n_per_mm, max_relative = 1e-4);
    assert_relative_eq!(a.energy_to_peak_n_mm, b.energy_to_peak_n_mm, max_relative = 1e-3);
    let rates: Vec<f64> = interrupted.force_n.iter().map(|force| force / 1500.0).collect();
    let rates = Qois::rates_of(&interrupted, 0.3, &Quantity::of_the_paper(), &rates).unwrap();
    assert_relative_eq!(rates[1], b.peak_force_n / 1500.0, max_relative = 1e-9);
    assert!(rates[2].abs() < 1e-12, "{rates:?}");
}

#[test]
fn a_curve_without_peak_has_quantities_that_need_none() {
    let hold = curve(&PROGRAM[..2], 20, solid(MAXWELL));
    assert!(value(&hold, RelaxedFraction).is_ok());
    let refused = PeakedCurve::new(&hold, 0.3).map(drop).unwrap_err();
    assert!(matches!(refused, QoiError::NoPeak { end: "end", .. }), "{refused}");
    let quantities = [Quantity::of_the_paper().to_vec(), vec![at(2.0)]].concat();
    assert_eq!(Qois::values_of(&hold, 0.3, &quantities), Err(refused));
}

#[test]
fn missing_times_and_branches_are_named() {
    let straight = curve(&[(2.0, 0.2)], 20, |_, x| 1500.0 * x);
    for (quantity, branch) in [
        (Quantity::new(RelaxedFraction), "no hold"),
        (Quantity::new(UnloadingSlope), "no unloading"),
        (Quantity::new(HysteresisEnergy), "no unloading"),
    ] {
        let message = Qois::values_of(&straight, 0.3, std::slice::from_ref(&quantity))
            .unwrap_err()
            .to_string();
        for part in [branch, &quantity.to_string(), "test.program"] {
            assert!(message.contains(part), "{part:?} is not in {message:?}");
        }
    }
    let message = Qois::values_of(&straight, 0.3, &[at(2.5)]).unwrap_err().to_string();
    assert!(message.contains("2.5 s for force-at-2.5-s"), "{message}");
    let timeless = TestCurve { time_s: Vec::new(), ..straight };
    let message = Qois::values_of(&timeless, 0.3, &[at(1.0)]).unwrap_err().to_string();
    assert!(message.contains("column time_s"), "{message}");
    assert!(ForceAtTime::microseconds(0).is_none());
}
