//! Inversion of tail probabilities.

use super::Tail;

/// The coordinate y where a tail of a distribution over ℝ holds the probability `p`.
///
/// `at(y)` gives the lower tail, the upper tail and the density there.
pub(crate) fn tail_quantile(
    start: f64,
    p: f64,
    tail: Tail,
    at: impl Fn(f64) -> (f64, f64, f64),
) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let target = p.ln();
    match tail {
        Tail::Lower if p == 0.0 => f64::NEG_INFINITY,
        Tail::Upper if p == 0.0 => f64::INFINITY,
        Tail::Lower => increasing_root(start, |y| {
            let (lower, _, density) = at(y);
            (lower.ln() - target, density / lower)
        }),
        Tail::Upper => increasing_root(start, |y| {
            let (_, upper, density) = at(y);
            (target - upper.ln(), density / upper)
        }),
    }
}

/// The root of an increasing function given as (value, slope): Newton's method inside a bracket
/// that grows from `start`.
///
/// Meant for ln P(tail) − ln p over an unconstrained coordinate, which is close to straight in
/// the tails. Values may be infinite: only the bracket moves then.
fn increasing_root(start: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (mut low, mut high) = (start, start);
    let mut step = 1.0;
    while f(low).0 > 0.0 && low.is_finite() {
        high = low;
        low -= step;
        step *= 2.0;
    }
    step = 1.0;
    while f(high).0 < 0.0 && high.is_finite() {
        low = high;
        high += step;
        step *= 2.0;
    }
    let mut y = 0.5 * (low + high);
    for _ in 0..200 {
        let (value, slope) = f(y);
        if value == 0.0 {
            return y;
        }
        if value > 0.0 {
            high = y;
        } else {
            low = y;
        }
        let newton = y - value / slope;
        // convergence is quadratic: a step this small leaves nothing to the next
        if (newton - y).abs() <= 1e-10 * (1.0 + y.abs()) {
            return newton;
        }
        let inside = newton > low && newton < high;
        let next = if inside { newton } else { 0.5 * (low + high) };
        if next == y || high - low <= f64::EPSILON * y.abs() {
            return y;
        }
        y = next;
    }
    y
}
