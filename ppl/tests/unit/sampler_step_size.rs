//! Dual averaging, compared with the recursion computed by hand.

use super::*;

/// The recursion was computed independently in Python with 17 digits; see [`DualAveraging`] for the formula.
#[test]
fn golden_sequence() {
    let mut step = DualAveraging::new(0.8, 0.5);
    let accepted = [0.3, 1.0, 0.95, 0.0, 0.72, 1.0];
    let currents = [
        2.0144516076456647,
        2.4653434569761985,
        3.352592341675178,
        0.3312612957613083,
        0.23190469789054852,
        0.3938017394474507,
    ];
    let averages = [
        2.0144516076456647,
        2.2715160780442187,
        2.6945307055164402,
        1.2842189883582098,
        0.7697181060867385,
        0.6462655349216961,
    ];
    for i in 0..6 {
        step.learn(accepted[i]);
        approx::assert_relative_eq!(step.current(), currents[i], max_relative = 1e-13);
        approx::assert_relative_eq!(step.average(), averages[i], max_relative = 1e-13);
    }
}

/// With a smooth function of the step size instead of the acceptance probability of HMC, the tuned step approaches
/// the target. The bias decreases as t^(−1/4), the rate at which the average forgets its first values.
#[test]
fn solves_for_the_target() {
    let acceptance = |step: f64| (-step * step).exp();
    let mut step = DualAveraging::new(0.8, 10.0);
    let mut errors = Vec::new();
    for t in 1..=64_000 {
        let a = acceptance(step.current());
        step.learn(a);
        if t == 1000 || t == 64_000 {
            errors.push((acceptance(step.average()) - 0.8).abs());
        }
    }
    assert!(errors[0] < 0.01, "{errors:?}");
    assert!(errors[1] < errors[0] / 2.0, "{errors:?}");
}
