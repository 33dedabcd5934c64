use super::*;

/// Returns the fields of two nodes at the given time.
fn fields(at: impl Fn(f64) -> f64, time: f64) -> Fields {
    let damage = vec![at(time), 2.0 - at(time)];
    let displacement = damage.iter().map(|d| [*d, -*d, 3.0 * d]).collect();
    Fields { displacement, damage, ..Fields::default() }
}

/// Returns the extrapolation to `target` of a function that is known at `times`, for a load without corners.
fn continued(at: &dyn Fn(f64) -> f64, times: &[f64], target: f64) -> f64 {
    continued_from(f64::NEG_INFINITY, at, times, target)
}

/// Returns the extrapolation to `target` of a function that is known at `times`, for a load with a corner.
fn continued_from(corner: f64, at: &dyn Fn(f64) -> f64, times: &[f64], target: f64) -> f64 {
    let mut past = Past::default();
    for pair in times.windows(2) {
        let mut change = fields(at, pair[1]);
        change.add_scaled(-1.0, &fields(at, pair[0]));
        past.add(change, pair[1] - pair[0]);
    }
    let last = *times.last().expect("times");
    let mut guess = fields(at, last);
    let largest = |term: &Fields| term.damage.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    past.continue_by(target - last, last - corner, &mut guess, |term| [largest(term); 2]);
    let others = guess.displacement[0].map(|u| u / guess.damage[0]);
    assert!(
        others.iter().zip([1.0, -1.0, 3.0]).all(|(u, exact)| (u - exact).abs() < 1e-12),
        "{others:?}"
    );
    assert!((guess.damage[0] + guess.damage[1] - 2.0).abs() < 1e-12);
    guess.damage[0]
}

#[test]
fn a_cubic_is_extrapolated_exactly_for_any_steps() {
    let cubic = |t: f64| 0.2 + 3.0 * t - 0.7 * t * t + 0.4 * t * t * t;
    let parabola = |t: f64| 1.0 - 2.0 * t + 0.3 * t * t;
    let times = [0.0, 0.05, 0.1, 0.3, 0.4, 0.43];
    for count in 2..=times.len() {
        for target in [0.44, 0.5] {
            let times = &times[..count];
            let order = (count - 1).min(MOST);
            if order >= 3 {
                let guess = continued(&cubic, times, target);
                assert!((guess - cubic(target)).abs() < 1e-12, "{count} times: {guess}");
            }
            if order >= 2 {
                let guess = continued(&parabola, times, target);
                assert!((guess - parabola(target)).abs() < 1e-12, "{count} times: {guess}");
            }
            let line = continued(&|t| 1.0 - t, times, target);
            assert!((line - (1.0 - target)).abs() < 1e-12, "{count} times: {line}");
        }
    }
}

#[test]
fn after_a_jump_or_a_reversal_of_the_clock_the_extrapolation_is_linear() {
    let jump = |t: f64| if t > 0.25 { 5.0 } else { t };
    let guess = continued(&jump, &[0.0, 0.1, 0.2, 0.3], 0.4);
    assert!((guess - (5.0 + 4.8)).abs() < 1e-12, "{guess}");
    let back = continued(&|t| t * t, &[0.0, 0.2, 0.4, 0.3], 0.25);
    assert!((back - (0.09 - 0.5 * 0.07)).abs() < 1e-12, "{back}");
}

/// The function has a slight kink at the corner, which a polynomial through both sides would not notice.
#[test]
fn the_extrapolation_does_not_use_equilibria_before_a_corner() {
    let kink = |t: f64| if t > 0.3 { 0.3 + 0.9 * (t - 0.3) } else { t };
    for times in [&[0.0, 0.1, 0.2, 0.3, 0.35][..], &[0.1, 0.2, 0.3, 0.35, 0.4]] {
        let guess = continued_from(0.3, &kink, times, 0.45);
        assert!((guess - kink(0.45)).abs() < 1e-12, "{times:?}: {guess}");
    }
    let across = continued(&kink, &[0.0, 0.1, 0.2, 0.3, 0.35], 0.45);
    assert!((across - 0.425).abs() < 1e-12, "{across}");
}
