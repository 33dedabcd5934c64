//! Inversion of tail probabilities.

use super::Tail;

/// Returns the coordinate y at which a tail of a distribution over ℝ has probability `p`. The search starts at
/// `start`.
///
/// `at(y)` returns the lower tail, the upper tail and the density at y.
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

/// Finds the root of an increasing function by Newton's method within a bracket, which is extended from `start`. `f`
/// returns the value and the slope of the function.
///
/// The method is intended for the function ln P(tail) − ln p of an unconstrained coordinate, which is nearly linear
/// in the tails. If a value is infinite, a bisection step is made.
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
        // convergence is quadratic: after a step as small as this limit, the error is below the rounding error
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
